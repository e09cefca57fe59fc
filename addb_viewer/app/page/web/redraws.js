// Without a graphics card a picture of the scene takes long, and viser draws it again and again for a quarter of a
// second after each change, for what may still come late. There, a picture without news waits a while; what somebody
// does on the scene, and what the server says, is drawn at once as ever. Runs before viser's script.
(() => {
  if (!window.WebGL2RenderingContext) return;
  const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
  const AT_ONCE = 3; // pictures after news: of what it changed, and of what that made the page change
  const WAIT_MS = 150;
  const SWINGS_MS = 700; // that the camera goes on after it was let go

  let slow = false, drew = false, left = AT_ONCE, drawn = 0, swings = 0;
  const draws = new WeakSet(); // callbacks that drew
  const news = () => (left = AT_ONCE);

  const getContext = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
    const context = getContext.call(this, kind, ...options);
    if (kind === "webgl2" && context) {
      const told = context.getExtension("WEBGL_debug_renderer_info");
      slow ||= SOFTWARE.test(context.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : context.RENDERER));
    }
    return context;
  };
  const clear = WebGL2RenderingContext.prototype.clear;
  WebGL2RenderingContext.prototype.clear = function (...buffers) {
    drew = true;
    return clear.apply(this, buffers);
  };
  window.Worker = class extends Worker {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", news);
    }
  };
  const handled = ({ target }) => target.tagName === "CANVAS" && (swings = performance.now() + SWINGS_MS);
  for (const what of ["pointerdown", "pointermove", "pointerup", "wheel"]) {
    window.addEventListener(what, handled, { capture: true, passive: true });
  }
  window.addEventListener("resize", news);

  const request = window.requestAnimationFrame, cancel = window.cancelAnimationFrame;
  const held = new Map(); // the browser's present number of what the page asked for, by the first
  window.requestAnimationFrame = (callback) => {
    const run = (time) => {
      const now = performance.now();
      if (slow && draws.has(callback) && !left && now < drawn + WAIT_MS && now > swings) {
        held.set(first, request(run));
        return;
      }
      held.delete(first);
      drew = false;
      callback(time);
      if (!drew) return;
      draws.add(callback);
      drawn = performance.now();
      left = Math.max(left - 1, 0);
    };
    const first = request(run);
    held.set(first, first);
    return first;
  };
  window.cancelAnimationFrame = (first) => {
    cancel(held.get(first) ?? first);
    held.delete(first);
  };
})();
