#!/usr/bin/env python3
"""compare.py DECODE_HASH N [SEED] [FILE...]: the golden streams (or the files), prefixes of them and N damaged copies must
become the same in decode.py, which was written from the document, as in DECODE_HASH, the C++ decoder."""
import os
import random
import subprocess
import sys
import tempfile

import decode

here = os.path.dirname(os.path.abspath(__file__))
golden = os.path.join(here, '../golden')
SMALL = (16, 1 << 13, 1 << 13)  # limits that keep damaged streams from taking long


# Options of decode.decode, and of the tool.
WAYS = [({}, []), ({'smoothed': True}, ['--smooth']), ({'points': True}, ['--points']),
        ({'wanted': '011'}, ['--patches', '011']),
        ({'points': True, 'wanted': '10', 'level': 1}, ['--points', '--patches', '10', '--level', '1']),
        ({'smoothed': True, 'level': 2, 'wanted': '110'}, ['--smooth', '--level', '2', '--patches', '110'])]
WAYS += [({'level': level}, ['--level', str(level)]) for level in (1, 2, 3, 4)]


def reference(data, limits, way):
    try:
        return decode.hashlib.sha256(decode.decode(data, limits, **WAYS[way][0])).hexdigest()
    except decode.Error as e:
        return str(e.args[0])


def header_numbers(data):
    """The header's varints: their values, where they end, and whether they are well formed."""
    at, values, ends, all_good = 29, [], [], True
    for _ in range(12 if data[4] & 4 else 8):
        value, at, good = decode.varint(data, at)
        values.append(value)
        ends.append(at)
        all_good = all_good and good
    return values, ends, all_good


def masks_end(data):
    values, ends, _ = header_numbers(data)
    return ends[-1] + values[5]


def damaged(data, header, generator):
    """Some bytes altered, mostly behind the header; now and then an end cut off or the seams replaced."""
    bytes_ = bytearray(data)
    for _ in range(generator.choice((1, 1, 2, 8))):
        first = 0 if generator.random() < 0.2 else header
        bytes_[generator.randrange(first, len(bytes_))] = generator.randrange(256)
    way = generator.randrange(5)
    if way == 0:
        del bytes_[generator.randrange(len(bytes_)):]
    elif way == 1:
        bytes_ = with_seams(bytes_, generator)
    return bytes(bytes_)


def with_seams(data, generator):
    _, ends, good = header_numbers(data)
    if not good or data[4] & 4:  # with colours they are not the last part
        return data
    seams = []
    for _ in range(4):  # lists of small differences
        for _ in range(generator.choice((0, 1, 1, 3, 10))):
            seams.append(generator.choice((1, 2, 3, 10, 40)))
        seams.append(0)
    if generator.random() < 0.5:  # a third list with partners
        seams = [0, 0] + [generator.choice((1, 2, 5, 9, 30)) for _ in range(2 * generator.randrange(8))] + [0] + seams[-6:]
    if generator.random() < 0.5:  # a fifth list, tubes between triangles
        seams += [generator.choice((1, 2, 7, 60)) for _ in range(2 * generator.randrange(4))]
    elif generator.random() < 0.7:  # a sixth one, Steiner points
        seams += [0] + [n for _ in range(generator.randrange(6)) for n in (generator.choice((1, 2, 5, 30)), generator.randrange(40))]
    old = decode.varint(data, ends[6])[0]
    body = data[ends[7]:len(data) - old] if old else data[ends[7]:]
    flags = bytearray(data[:ends[6]])
    if generator.random() < 0.5:
        flags[4] = 0
    return flags + bytes([len(seams)]) + body + bytes(seams)


def main(tool, count, seed=1, *files):
    generator = random.Random(int(seed))
    names = list(files) or sorted(os.path.join(golden, n) for n in os.listdir(golden) if n.endswith('.relief'))
    streams = [open(n, 'rb').read() for n in names]
    jobs = [(s, decode.LIMITS, way) for s in streams for way in range(len(WAYS))]
    for s in streams:  # cut within the masks, and anywhere
        for end in 3 * [masks_end(s)] + [len(s)]:
            jobs.append((s[:generator.randrange(29, end)], decode.LIMITS, generator.choice([0, 0, *range(len(WAYS))])))
    for _ in range(int(count)):
        s = generator.choice(streams)
        jobs.append((damaged(s, 29, generator), SMALL, generator.choice([0, 0, 0, 0, 0, 0, 0, *range(len(WAYS))])))
    differing = decoded = 0
    with tempfile.TemporaryDirectory() as folder:
        for limits, way in sorted({job[1:] for job in jobs}):
            mine = [job[0] for job in jobs if job[1:] == (limits, way)]
            paths = []
            for i, data in enumerate(mine):
                paths.append(os.path.join(folder, str(i)))
                open(paths[-1], 'wb').write(data)
            command = [tool, '--limits', *map(str, limits), *WAYS[way][1], *paths]
            theirs = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
            assert len(theirs) == len(mine)
            for data, result in zip(mine, theirs):
                ours = reference(data, limits, way)
                decoded += len(ours) == 64
                if ours != result:
                    differing += 1
                    print('differs:', ours, result, *WAYS[way][1], data.hex())
    print('%d streams, %d of them decoded, %d differ' % (len(jobs), decoded, differing))
    return 1 if differing or decoded < len(jobs) // 4 else 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
