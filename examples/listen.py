"""Prints a fleet's broadcasts, with plain zenoh-python and msgpack: python listen.py tcp/HOST:PORT FLEET [COUNT]."""

import json
import sys

import msgpack
import zenoh

endpoint, fleet, count = sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 10**9
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
with zenoh.open(config) as session:
    heard = session.declare_subscriber(f"swarm/v1/{fleet}/radio/**", zenoh.handlers.FifoChannel(1000))
    print("listening", flush=True)
    for _, sample in zip(range(count), heard, strict=False):
        said = msgpack.unpackb(sample.payload.to_bytes())
        print(
            f"{said['robot']} at ({said['x']:.1f}, {said['y']:.1f}): {said['activity']}, "
            f"{said['distance']:.1f} m to target {said['target'] + 1}",
            flush=True,
        )
