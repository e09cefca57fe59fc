// Codes the pictures of a film of the scene: one comes over the channel, and when it is coded, goes back and the next
// one comes. The server packs them, each with its time.
const KEY_EVERY = 25; // pictures, from one that stands alone to the next
const BITS = 0.2; // of a picture's point

let encoder = null, codec = "", coded = [], description = "";
const text = async (bytes) =>
  (await new Promise((done) => {
    const reader = new FileReader();
    reader.onload = () => done(reader.result);
    reader.readAsDataURL(new Blob([bytes]));
  })).split(",")[1];

const begin = async ({ width, height, rate }) => {
  if (!window.VideoEncoder)
    throw new Error("This browser codes no films here. Open the app at 127.0.0.1 or over HTTPS, in a browser of this year.");
  const size = { width, height, framerate: rate, bitrate: Math.round(BITS * width * height * rate), latencyMode: "realtime" };
  const wished = [{ codec: "avc1.4d0032", avc: { format: "avc" } }, { codec: "avc1.42e032", avc: { format: "avc" } }, { codec: "vp09.00.31.08" }];
  for (const one of wished) {
    const config = { ...one, ...size };
    if (!(await VideoEncoder.isConfigSupported(config)).supported) continue;
    end();
    codec = one.codec.slice(0, 4);
    description = "";
    encoder = new VideoEncoder({
      output: (chunk, about) => coded.push([chunk, about?.decoderConfig?.description]),
      error: () => {},
    });
    encoder.configure(config);
    return;
  }
  throw new Error("This browser codes neither H.264 nor VP9.");
};
const end = () => {
  if (encoder && encoder.state !== "closed") encoder.close();
  encoder = null;
};
const code = async (asked) => {
  if (asked.number === 0) await begin(asked);
  const picture = await createImageBitmap(await (await fetch(`data:image/jpeg;base64,${asked.jpeg}`)).blob());
  const frame = new VideoFrame(picture, { timestamp: Math.round((1e6 * asked.number) / asked.rate) });
  coded = [];
  encoder.encode(frame, { keyFrame: asked.number % KEY_EVERY === 0 });
  frame.close();
  picture.close();
  await encoder.flush();
  if (coded.length !== 1) throw new Error("The browser's coder left out a picture.");
  const [[chunk, about]] = coded;
  const bytes = new Uint8Array(chunk.byteLength);
  chunk.copyTo(bytes);
  if (about) description = await text(about);
  return { number: asked.number, codec, description, data: await text(bytes), alone: chunk.type === "key" };
};
window.addb.on("coding", async (asked) => {
  if (!asked) return end();
  let answer;
  try {
    answer = await code(asked);
  } catch (error) {
    answer = { number: asked.number, error: error.message };
  }
  window.addb.send("coded", answer);
});
