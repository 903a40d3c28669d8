"""Follows a room, one line of JSON per snapshot: python3 stream.py HOST:PORT ROOM [SNAPSHOTS]

Needs Python 3.11 and nothing else. It reads what positions depend on: deaths, moves, births, and which
players have a pointer, since pointers move too. The sections after the players are not read.
"""
import base64, itertools, json, os, socket, struct, sys, tomllib

LIMIT = 2 ** 24  # quanta

# The socket.

def connect(host, room):
    """Upgrades as in RFC 6455; the response headers are skipped."""
    name, port = host.rsplit(":", 1)
    wire = socket.create_connection((name, int(port))).makefile("rwb")
    key = base64.b64encode(os.urandom(16)).decode()
    wire.write(f"GET /{room} HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
               f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode())
    wire.flush()
    answer = [wire.readline()]
    while answer[-1] not in (b"\r\n", b""): answer.append(wire.readline())
    if b" 101 " not in answer[0]: sys.exit(f"no WebSocket: {answer[0]}")
    return wire

def send(wire, payload, opcode=2):
    """Sends one frame of less than 126 bytes, masked with zeros: a mask is mandatory."""
    wire.write(bytes([0x80 | opcode, 0x80 | len(payload)]) + bytes(4) + payload)
    wire.flush()

def receive(wire):
    """Returns the next message, and answers pings before it."""
    while head := wire.read(2):
        opcode, size = head[0] & 15, head[1]
        if size > 125: size = int.from_bytes(wire.read(2 if size == 126 else 8), "big")
        payload = wire.read(size)
        if opcode == 2: return payload
        if opcode == 9: send(wire, payload, 10)
        if opcode == 8: break
    sys.exit("the server closed the socket")

def join(host, room, name="Python"):
    """Joins; returns the socket, and the size of a quantum in world units."""
    wire = connect(host, room)
    send(wire, struct.pack("<BHB", 0, 5, len(name)) + name.encode() + bytes([0, 0, 0, 0]))
    welcome = Reader(receive(wire))
    if welcome.u8() != 0: sys.exit(f"refused, see the protocol: {welcome.u8()}")
    _is_seated, _seat, _host = welcome.u8(), welcome.leb(), welcome.u8()
    _token, _tick = welcome.raw(34), welcome.leb()
    _code, _name, scene = welcome.text(), welcome.text(), tomllib.loads(welcome.text())
    return wire, scene.get("quantum", 1 / 64)

# Bytes and bits.

class Reader:
    """Reads numbers from the front of a message."""
    def __init__(self, data): self.data, self.at = data, 0
    def raw(self, count): self.at += count; return self.data[self.at - count:self.at]
    def u8(self): return self.raw(1)[0]
    def f32(self): return struct.unpack("<f", self.raw(4))[0]
    def leb(self):
        byte = self.u8()
        return byte if byte < 128 else byte - 128 + 128 * self.leb()
    def zig(self): return unfold(self.leb())
    def quanta(self): return [self.zig(), self.zig()]
    def text(self): return self.raw(self.leb()).decode()

def lebs(number):
    return bytes([number]) if number < 128 else bytes([number & 127 | 128]) + lebs(number >> 7)

def unfold(number): return number >> 1 ^ -(number & 1)

class Bits:
    """Reads numbers from a sequence of bits, the lowest of each byte first."""
    def __init__(self, data): self.value, self.at = int.from_bytes(data, "little"), 0
    def take(self, count):
        self.at += count
        return self.value >> self.at - count & (1 << count) - 1
    def golomb(self):
        ones = 0
        while self.take(1): ones += 1
        return (1 << ones | self.take(ones)) - 1
    def wide(self, width):
        high = 0
        while high < 4 and self.take(1): high += 1
        if high == 4: high += self.golomb()
        return high << width | self.take(width)

# Moves. A history holds a point's four newest positions, starting with the newest.

def displacements(history, axis): return [history[age][axis] - history[age + 1][axis] for age in range(3)]

def expected(history):
    a = [displacements(history, axis)[0] for axis in (0, 1)]
    steady = [p if abs(a) <= 1 else p + a for p, a in zip(history[0], a)]
    return [max(-LIMIT, min(LIMIT, p)) for p in steady]

def width(history, axis):
    a, b, c = displacements(history, axis)
    return (3 * (abs(a - b) + abs(b - c)) // 8).bit_length()

def read_moves(reader, histories):
    """Reads the new positions of the points."""
    bits, positions, resting = Bits(reader.data[reader.at:]), [], []
    for history in histories:
        position = expected(history)
        if history[1:] == [history[0]] * 3:
            resting.append(len(positions))
        elif bits.take(1):
            position = [position[axis] + unfold(bits.wide(width(history, axis))) for axis in (0, 1)]
        positions.append(position)
    waking, at = bits.golomb(), -1
    gap = max(1, len(resting) // (waking + 1)).bit_length() - 1
    for _ in range(waking):
        at += 1 + bits.wide(gap)
        positions[resting[at]] = [p + unfold(bits.wide(2)) for p in positions[resting[at]]]
    reader.raw((bits.at + 7) // 8)
    return positions

# Bodies and players.

def births(reader):
    """Section 2 of a snapshot: index, generation and centre of each."""
    index = -1
    for _ in range(reader.leb()):
        index += 1 + reader.leb()
        generation, tag, _group = reader.leb(), reader.u8(), reader.u8()
        if tag & 16: reader.leb()  # the owner
        _size = [reader.f32() for _ in range(2 if tag & 8 else 1)]
        yield index, generation, reader.quanta()

def optional(reader, read):
    return read() if reader.u8() else None

def read_id(reader): return reader.leb(), reader.leb()

def read_bits(reader, count):
    bits = Bits(reader.raw((count + 7) // 8))
    return [bits.take(1) for _ in range(count)]

class Stream:
    """State between two messages: bodies and pointers with their histories."""
    def __init__(self): self.tick, self.bodies, self.pointers = 0, [], {}

    def read(self, message):
        reader = Reader(message)
        sections = reader.u8()
        if sections & 64:
            self.__init__()
            self.tick, _every = reader.leb(), reader.u8()
        else:
            self.tick += (reader.u8() - self.tick) % 256
        if sections & 1:
            index, dead = -1, set()
            for _ in range(reader.leb()):
                index += 1 + reader.leb()
                dead.add(index)
            self.bodies = [body for index, body in enumerate(self.bodies) if index not in dead]
        self.move(reader, sections)
        if sections & 4:
            born = [(index, generation, [position] * 4) for index, generation, position in births(reader)]
            self.bodies = sorted(self.bodies + born, key=lambda body: body[0])
        if sections & 8:
            self.read_players(reader)

    def move(self, reader, sections):
        histories = [history for _, _, history in self.bodies]
        histories += [self.pointers[seat] for seat in sorted(self.pointers) if self.pointers[seat]]
        positions = read_moves(reader, histories) if sections & 2 else map(expected, histories)
        for history, position in zip(histories, positions):
            history[:] = [position] + history[:3]

    def read_players(self, reader):
        """Keeps the pointers by seat; a player may have none."""
        parts = reader.u8()
        if parts & 1:
            gone = read_bits(reader, len(self.pointers))
            self.pointers = dict(itertools.compress(sorted(self.pointers.items()), [not g for g in gone]))
        if parts & 2:
            changed = read_bits(reader, len(self.pointers))
            for seat in itertools.compress(sorted(self.pointers), changed):
                self.change(reader, seat)
        if parts & 4:
            for _ in range(reader.leb()):
                seat, _name, _colour, _connected = reader.leb(), reader.text(), reader.u8(), reader.u8()
                _bodies = [optional(reader, lambda: read_id(reader)) for _ in range(3)]
                _score, pointer = reader.leb(), optional(reader, reader.quanta)
                _input = reader.leb()
                self.pointers[seat] = pointer and [pointer] * 4

    def change(self, reader, seat):
        fields = reader.u8()
        if fields & 1: reader.text(), reader.u8()
        for field in (4, 8, 16):
            if fields & field: optional(reader, lambda: read_id(reader))
        if fields & 32: reader.leb()
        if fields & 64:
            self.pointers[seat] = None if self.pointers[seat] else [reader.quanta()] * 4
        if fields & 128: reader.leb()

if __name__ == "__main__":
    wire, quantum = join(*sys.argv[1:3])
    stream, left, seq = Stream(), int(sys.argv[3]) if len(sys.argv) > 3 else -1, 0
    while left:
        if (message := receive(wire))[0] < 128: continue  # not a snapshot
        stream.read(message)
        left -= 1
        if left % 10 == 0:  # an input without buttons acknowledges the tick
            seq += 1
            send(wire, bytes([1]) + lebs(seq) + struct.pack("<H", stream.tick & 0xffff) + bytes(2))
        positions = {f"{index}.{generation}": [axis * quantum for axis in history[0]]
                     for index, generation, history in stream.bodies}
        print(json.dumps({"tick": stream.tick, "bodies": positions}), flush=True)
