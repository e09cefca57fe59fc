"""A small MP4 whose every picture tells its number by its brightness: coded by Chromium."""

import base64

from addb_viewer.app.scene.mp4 import Coded, Coding, mp4

RATE, PICTURES, STEP = 25, 50, 5  # [Hz]; brightness from one picture to the next

ENCODE = """async ([count, rate, step]) => {
    const canvas = new OffscreenCanvas(160, 120), pen = canvas.getContext("2d"), made = [];
    const bytes = (chunk) => {
        const data = new Uint8Array(chunk.byteLength);
        chunk.copyTo(data);
        return btoa(String.fromCharCode(...data));
    };
    const output = (chunk) => made.push([bytes(chunk), chunk.type === "key"]);
    const encoder = new VideoEncoder({ output, error: console.error });
    encoder.configure({ codec: "vp09.00.10.08", width: 160, height: 120, framerate: rate });
    for (let k = 0; k < count; k++) {
        pen.fillStyle = `rgb(${step * k},${step * k},${step * k})`;
        pen.fillRect(0, 0, 160, 120);
        const frame = new VideoFrame(canvas, { timestamp: (1e6 * k) / rate, duration: 1e6 / rate });
        encoder.encode(frame, { keyFrame: true });
        frame.close();
    }
    await encoder.flush();
    return made;
}"""


def encoded(page):
    """Pictures of VP9; the page is one of a server on this machine."""
    return [Coded(base64.b64decode(data), key) for data, key in page.evaluate(ENCODE, [PICTURES, RATE, STEP])]


def packed(pictures, code="vp09"):
    return mp4(pictures, Coding(code, (160, 120), RATE))
