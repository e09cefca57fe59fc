// The video beside the scene follows the cursor: it is sought while that rests, and plays along while it runs forwards.
import { strip } from "./bar.js";
import { element } from "./elements.js";

// Muted, so that it may play unasked.
const film = element("video", { muted: true, playsInline: true, preload: "auto", disablePictureInPicture: true });
const words = element("figcaption");
const box = element("figure", { id: "addb-video", hidden: true, "aria-label": "Video of the recording" }, film, words);
strip.after(box);

const JUST_AFTER_S = 0.001; // so that rounding does not show the picture before
const LOST_S = 0.25; // farther off than that it is sought; nearer, it runs a little faster or slower
const PULL = 2, MOST_PULL = 0.3; // share of the speed for each second that it is off; at most
const SLOWEST = 0.0625, FASTEST = 16; // at which browsers play

let shown = null, frame = 0, speed = 0, wanted = null;
const target = () => shown.offset + (shown.scale * frame) / shown.rate + JUST_AFTER_S;
const seek = (time) => {
  if (film.seeking) wanted = time;
  else if (Math.abs(film.currentTime - time) > 1e-4) film.currentTime = time;
};
film.addEventListener("seeked", () => {
  const time = wanted;
  wanted = null;
  if (time !== null) seek(time);
});
const follow = () => {
  if (!shown || !(film.duration > 0)) return;
  const time = target(), rate = speed * shown.scale;
  const within = time >= 0 && time < film.duration;
  box.classList.toggle("outside", !within);
  words.textContent = within ? shown.name : `${shown.name}: nothing at this time`;
  if (within && rate >= SLOWEST && rate <= FASTEST) {
    const behind = time - film.currentTime;
    if (Math.abs(behind) > LOST_S * Math.max(rate, 1)) seek(time);
    const pull = Math.min(Math.max((PULL * behind) / rate, -MOST_PULL), MOST_PULL);
    film.playbackRate = Math.min(Math.max(rate * (1 + pull), SLOWEST), FASTEST);
    if (film.paused) film.play().catch(() => {});
  } else {
    if (!film.paused) film.pause();
    seek(Math.min(Math.max(time, 0), film.duration));
  }
};
film.addEventListener("loadedmetadata", follow);
film.addEventListener("error", () => shown && (words.textContent = words.title = `${shown.name}: this browser does not play it. ${shown.advice}`));
window.addb.on("video", (video) => {
  if (shown?.url !== video?.url) {
    if (video) film.src = video.url;
    else film.removeAttribute("src");
    film.load();
    words.textContent = video?.name ?? "";
  }
  shown = video;
  box.hidden = !video;
  follow();
});
window.addb.on("cursor", (now) => {
  frame = now;
  follow();
});
window.addb.on("plays", (now) => {
  speed = now;
  follow();
});
