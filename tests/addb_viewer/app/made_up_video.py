"""A small MP4 whose every picture tells its number by its brightness: coded by Chromium, packed here."""

import base64
import struct

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
    """Pictures of VP9 and whether each stands alone; the page is one of a server on this machine."""
    made = page.evaluate(ENCODE, [PICTURES, RATE, STEP])
    return [(base64.b64decode(data), key) for data, key in made]


def box(kind, *parts):
    body = b"".join(parts)
    return struct.pack(">I4s", 8 + len(body), kind) + body


def full(kind, *parts, flags=0):
    """With a version and flags."""
    return box(kind, struct.pack(">I", flags), *parts)


def packed(pictures, code=b"vp09", handler=b"vide"):
    """An MP4 of ISO/IEC 14496-12, all pictures in one chunk."""
    matrix = struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)
    n, ticks = len(pictures), 1000 * len(pictures)
    clock = 1000 * RATE
    head = box(b"ftyp", b"isom", struct.pack(">I", 512), b"isommp41")
    entry = struct.pack(">6xH16xHHIIIH32xHh", 1, 160, 120, 0x480000, 0x480000, 0, 1, 24, -1)
    config = full(b"vpcC", bytes([0, 10, 0x82, 1, 1, 1, 0, 0]), flags=0x01000000)
    alone = [k + 1 for k, (_, key) in enumerate(pictures) if key]

    def movie(start):
        table = box(
            b"stbl",
            full(b"stsd", struct.pack(">I", 1), box(code, entry, config)),
            full(b"stts", struct.pack(">III", 1, n, 1000)),
            full(b"stsc", struct.pack(">IIII", 1, 1, n, 1)),
            full(b"stsz", struct.pack(">II", 0, n), *(struct.pack(">I", len(d)) for d, _ in pictures)),
            full(b"stco", struct.pack(">II", 1, start)),
            full(b"stss", struct.pack(">I", len(alone)), *(struct.pack(">I", k) for k in alone)),
        )
        data = box(b"dinf", full(b"dref", struct.pack(">I", 1), full(b"url ", flags=1)))
        media = box(
            b"mdia",
            full(b"mdhd", struct.pack(">IIIIHH", 0, 0, clock, ticks, 0x55C4, 0)),
            full(b"hdlr", struct.pack(">I4s12x", 0, handler), b"\0"),
            box(b"minf", full(b"vmhd", bytes(8), flags=1), data, table),
        )
        track = full(
            b"tkhd",
            struct.pack(">IIIIIII", 0, 0, 1, 0, ticks, 0, 0) + bytes(8) + matrix,
            struct.pack(">II", 160 << 16, 120 << 16),
            flags=3,
        )
        header = struct.pack(">IIIIIH10x", 0, 0, clock, ticks, 0x10000, 0x100) + matrix + bytes(24)
        return box(b"moov", full(b"mvhd", header, struct.pack(">I", 2)), box(b"trak", track, media))

    start = len(head) + len(movie(0)) + 8
    return head + movie(start) + box(b"mdat", *(data for data, _ in pictures))
