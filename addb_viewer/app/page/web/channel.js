// The page's end of the channel of our own; see channel.py. Runs before viser's script: it answers what that one asks
// of the browser's memory about this page.
(() => {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  const name = [...bytes].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  const RETRY_MS = 300;

  const getItem = Storage.prototype.getItem;
  Storage.prototype.getItem = function (key) {
    if (key === "viser-user:addb-viewer-page") return JSON.stringify({ name, query: location.search.slice(1) });
    return getItem.call(this, key);
  };

  const known = new Map(); // the newest value of each kind
  const listeners = new Map();
  let socket = null;

  const hear = ({ data }) => {
    const [kind, value] = JSON.parse(data);
    known.set(kind, value);
    for (const listener of listeners.get(kind) ?? []) listener(value);
  };
  const connect = () => {
    const opened = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/addb/page`);
    opened.onopen = () => {
      opened.send(name);
      socket = opened;
    };
    opened.onmessage = hear;
    opened.onclose = () => {
      socket = null;
      setTimeout(connect, RETRY_MS);
    };
  };
  connect();

  window.addb = {
    /** Calls back with each new value of a kind, and at once with the present one. */
    on(kind, listener) {
      listeners.set(kind, [...(listeners.get(kind) ?? []), listener]);
      if (known.has(kind)) listener(known.get(kind));
    },
    /** Asks the session for something; dropped where there is no session. */
    send(kind, value = null) {
      if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify([kind, value]));
    },
  };

  // The address names the frame on the screen. A browser allows a hundred changes in 30 s: what is scrubbed over is
  // not written.
  let wanted = null;
  window.addb.on("address", (address) => (wanted = address));
  setInterval(() => {
    if (wanted && location.pathname + location.search !== wanted) history.replaceState(history.state, "", wanted);
  }, 500);
})();
