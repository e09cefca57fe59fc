// Makes a film of pictures of the scene: they come over the channel one by one, and when all are there the browser records
// them as they are shown on a canvas, each at its moment.
const KINDS = ["video/mp4;codecs=avc1.4d0032", "video/mp4", "video/webm;codecs=vp9", "video/webm"]; // the first that the browser records
const BITS = 0.2; // of a picture's point
const CHUNK_MS = 40, WARM_UP_MS = 3000, COOL_DOWN_MS = 250;

let pictures = [];
const until = (moment) => new Promise((done) => setTimeout(done, Math.max(moment - performance.now(), 0)));

async function record({ width, height, rate, name }) {
  const type = KINDS.find((kind) => window.MediaRecorder?.isTypeSupported(kind));
  if (!type) throw new Error("This browser records no films.");
  const canvas = Object.assign(document.createElement("canvas"), { width, height }), pen = canvas.getContext("2d");
  const stream = canvas.captureStream(0), [track] = stream.getVideoTracks();
  const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: Math.round(BITS * width * height * Math.min(rate, 30)) });
  const parts = [];
  recorder.ondataavailable = ({ data }) => data.size && parts.push(data);
  const ended = new Promise((done) => (recorder.onstop = done));
  const show = (picture) => {
    pen.drawImage(picture, 0, 0, width, height);
    track.requestFrame();
  };
  recorder.start(CHUNK_MS);
  for (const latest = performance.now() + WARM_UP_MS; !parts.length && performance.now() < latest; ) {
    show(pictures[0]); // what comes before the coder is there is lost
    await until(performance.now() + CHUNK_MS);
  }
  const begun = performance.now();
  for (const [number, picture] of pictures.entries()) {
    await until(begun + (1000 * number) / rate);
    show(picture);
  }
  await until(begun + (1000 * pictures.length) / rate);
  show(pictures.at(-1));
  await until(performance.now() + COOL_DOWN_MS); // what is still being coded when it stops is lost as well
  recorder.stop();
  await ended;
  const file = new Blob(parts, { type }), address = URL.createObjectURL(file);
  const ending = type.startsWith("video/mp4") ? "mp4" : "webm";
  Object.assign(document.createElement("a"), { href: address, download: `${name}.${ending}` }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60000);
  return { name: `${name}.${ending}`, bytes: file.size };
}
window.addb.on("filming", async (asked) => {
  if (!asked) return (pictures = []);
  let answer = { number: asked.number };
  try {
    if (asked.number === 0) pictures = [];
    pictures.push(await createImageBitmap(await (await fetch(`data:image/jpeg;base64,${asked.jpeg}`)).blob()));
    if (pictures.length === asked.count) answer = { ...answer, ...(await record(asked)) };
  } catch (error) {
    answer = { number: asked.number, error: error.message };
  }
  window.addb.send("filmed", answer);
});
