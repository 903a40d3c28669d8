"""Joins a room and prints the positions of its bodies: python3 positions.py HOST:PORT ROOM

Needs Python 3.11 and nothing else. It reads only the keyframe that follows the welcome; stream.py
reads on.
"""
import io, socket, struct, sys, tomllib

host, room = sys.argv[1:]
name, port = host.rsplit(":", 1)
wire = socket.create_connection((name, int(port))).makefile("rwb")
wire.write(f"GET /{room} HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
           "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: YW55IHNpeHRlZW4gYnl0ZQ==\r\n\r\n".encode())
hello = struct.pack("<BHB", 0, 5, 6) + b"Python" + bytes(4)  # version 5, a name, colour 0, no tokens, a player
wire.write(bytes([0x82, 0x80 | len(hello)]) + bytes(4) + hello)  # a frame, masked with zeros
wire.flush()
while len(wire.readline()) > 2: pass  # the response headers

def message():
    _opcode, size = wire.read(2)
    if size > 125: size = int.from_bytes(wire.read(2 if size == 126 else 8), "big")
    return io.BytesIO(wire.read(size))

def u8(data): return data.read(1)[0]
def f32(data): return struct.unpack("<f", data.read(4))[0]
def text(data): return data.read(leb(data)).decode()
def zig(data): number = leb(data); return number >> 1 ^ -(number & 1)
def leb(data):
    byte = u8(data)
    return byte if byte < 128 else byte - 128 + 128 * leb(data)

welcome = message()
if u8(welcome) != 0: sys.exit(f"refused: {u8(welcome)}")
has_seat, seat, host, token, tick = u8(welcome), leb(welcome), u8(welcome), welcome.read(34), leb(welcome)
code, scene = text(welcome), text(welcome)
quantum = tomllib.loads(text(welcome)).get("quantum", 1 / 64)

while (keyframe := message()).getvalue()[0] < 128: pass  # messages of other kinds
sections, tick, every, index = u8(keyframe), leb(keyframe), u8(keyframe), -1
print("tick", tick)
for _ in range(leb(keyframe) if sections & 4 else 0):
    index += 1 + leb(keyframe)
    generation, tag, group = leb(keyframe), u8(keyframe), u8(keyframe)
    owner = leb(keyframe) if tag & 16 else None
    size = [f32(keyframe) for _ in range(2 if tag & 8 else 1)]
    print(f"{index}.{generation}", zig(keyframe) * quantum, zig(keyframe) * quantum)
