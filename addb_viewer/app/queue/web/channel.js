// The connection to the server; it comes back by itself.

const AGAIN_MS = [500, 1000, 2000, 5000];

export class Channel {
  constructor(heard, opened, lost) {
    Object.assign(this, { heard, opened, lost, tries: 0 });
    this.open();
  }

  open() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/addb/queue`);
    this.socket = socket;
    socket.addEventListener("open", () => {
      this.tries = 0;
      this.opened();
    });
    socket.addEventListener("message", (event) => this.heard(JSON.parse(event.data)));
    socket.addEventListener("close", () => {
      this.lost();
      setTimeout(() => this.open(), AGAIN_MS[Math.min(this.tries++, AGAIN_MS.length - 1)]);
    });
  }

  say(what, more = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ what, ...more }));
  }
}
