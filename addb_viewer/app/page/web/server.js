// What the review page and the queue share: a connection to the server, and what the browser remembers of the reviewer.

const AGAIN_MS = 300;
const ITEM = "addb-viewer"; // in the browser's storage

export const system = matchMedia("(prefers-color-scheme: dark)");

export const remembered = () => {
  try {
    return JSON.parse(localStorage.getItem(ITEM)) ?? {};
  } catch {
    return {}; // a browser that keeps nothing
  }
};

export const remember = (change) => {
  try {
    localStorage.setItem(ITEM, JSON.stringify({ ...remembered(), ...change }));
  } catch {
    // a browser that keeps nothing
  }
};

/** A connection that comes back by itself. Gives what speaks to the server; while there is none, that is dropped. */
export function connect(path, { opened, heard, lost = () => {} }) {
  let socket;
  const say = (said) => {
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(said));
  };
  const open = () => {
    socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}`);
    socket.onopen = opened;
    socket.onmessage = ({ data }) => heard(JSON.parse(data));
    socket.onclose = () => {
      lost();
      setTimeout(open, AGAIN_MS);
    };
  };
  open();
  return say;
}
