"""Reads a recording with other people's libraries: pip install numpy mcap mcap-protobuf-support.

Decodes every message of every topic, reads /state without protobuf, checks attachments and metadata, and
prints a JSON summary. The exit code is not 0 if anything is wrong.
"""

import json
import sys

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

SCHEMAS = {
    "/state": "foxglove.PointCloud",
    "/mesh": "foxglove.SceneUpdate",
    "/energy": "pliant.Energy",
    "/tf": "foxglove.FrameTransform",
    "/log": "foxglove.Log",
}
ELEMENTS = "/elements/"
COLUMNS = {"edge": 2, "tri": 3, "surface": 3, "tet": 4, "tri6": 6, "tet10": 10}


def check(condition, what):
    if not condition:
        raise SystemExit(f"{sys.argv[1]}: {what}")


def rows_of_elements(channel, data):
    """The rows of a message as (n, fields) doubles, the first three being where the element is."""
    fields = channel.metadata["fields"].split(",")
    n, stride = int(channel.metadata["point_count"]), int(channel.metadata["point_stride"])
    check(stride == 8 * len(fields) and fields[:3] == ["x", "y", "z"], f"unknown layout of {channel.topic}")
    check(channel.metadata["row"] == "element", f"rows of {channel.topic} are of {channel.metadata['row']}")
    bodies = json.loads(channel.metadata["bodies"])
    check(sum(body["count"] for body in bodies) == n, f"rows of {channel.topic} do not add up")
    return np.frombuffer(memoryview(data)[len(data) - n * stride :], "<f8").reshape(n, -1)


def state_without_protobuf(channel, data):
    """Points of a message as (n, 6) doubles: the field `data` is the last one, so its bytes are."""
    n = int(channel.metadata["point_count"])
    stride = int(channel.metadata["point_stride"])
    check(stride == 48 and channel.metadata["fields"] == "x,y,z,vx,vy,vz", "unknown layout of /state")
    view = memoryview(data)
    return np.frombuffer(view[len(view) - n * stride :], "<f8").reshape(n, 6)


def main():
    with open(sys.argv[1], "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        check(summary is not None, "no summary")
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        check("pliant" in metadata and "outcome" in metadata, "metadata is missing")
        about = metadata["pliant"]
        vertices, dimension = int(about["vertex_count"]), int(about["dimension"])
        check(
            sum(body["vertices"] for body in json.loads(about["bodies"])) == vertices, "bodies do not add up"
        )

        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        for name, data in attachments.items():
            if name.startswith("topology/"):
                cells = np.frombuffer(data, "<u4").reshape(-1, COLUMNS[name.split(".")[-2]])
                check(
                    cells.size > 0 and cells.max() < vertices,
                    f"{name} refers to a vertex that does not exist",
                )
        if "rest.f64" in attachments:
            rest = np.frombuffer(attachments["rest.f64"], "<f8").reshape(vertices, dimension)
            check(np.isfinite(rest).all(), "rest.f64 is not finite")

        counts, bounds, last_time, encoded = {}, [], {}, set()
        for schema, channel, message in reader.iter_messages():
            topic = channel.topic
            expected = SCHEMAS["/state"] if topic.startswith(ELEMENTS) else SCHEMAS.get(topic)
            expected = "pliant.Probe" if topic.startswith("/probe/") else expected
            check(schema.name == expected, f"{topic} is {schema.name}")
            check(message.log_time >= last_time.get(topic, 0), f"{topic} goes back in time")
            last_time[topic] = message.log_time
            counts[topic] = counts.get(topic, 0) + 1
            encoded.add(channel.message_encoding)
            if topic == "/state":
                points = state_without_protobuf(channel, message.data)
                check(np.isfinite(points).all(), "/state is not finite")
                check(dimension == 3 or not points[:, [2, 5]].any(), "2D is not in the plane z = 0")
                bounds.append([points[:, :3].min(axis=0), points[:, :3].max(axis=0)])
            elif topic.startswith(ELEMENTS):
                check(np.isfinite(rows_of_elements(channel, message.data)).all(), f"{topic} is not finite")
            elif channel.message_encoding == "json":
                row = json.loads(message.data)
                known = json.loads(schema.data)["properties"]
                check(set(row) <= set(known), f"{topic} has fields that its schema lacks")
                check(abs(row["time"] * 1e9 - message.log_time) <= 1, f"{topic} disagrees about the time")

        decoded = 0
        topics = [topic for topic in counts if topic != "/energy" and not topic.startswith("/probe/")]
        for _, channel, message, content in reader.iter_decoded_messages(topics=topics) if topics else []:
            decoded += 1
            if channel.topic == "/state":
                points = np.frombuffer(content.data, "<f8").reshape(-1, 6)
                check(
                    (points == state_without_protobuf(channel, message.data)).all(), "/state reads two ways"
                )
                check(
                    [field.offset for field in content.fields] == list(range(0, 48, 8)), "offsets of /state"
                )
                check(content.fields[0].type == 8, "/state is not FLOAT64")
            elif channel.topic.startswith(ELEMENTS):
                rows = rows_of_elements(channel, message.data)
                points = np.frombuffer(content.data, "<f8").reshape(rows.shape)
                check((points == rows).all(), f"{channel.topic} reads two ways")
                check(len(content.fields) == rows.shape[1], f"fields of {channel.topic}")
            elif channel.topic == "/mesh":
                for entity in content.entities:
                    for part in [*entity.triangles, *entity.lines]:
                        check(max(part.indices) < len(part.points), "/mesh: index without a point")
        check(decoded == sum(counts[topic] for topic in topics), "not every message was decoded")
        if "/state" in counts and "/energy" in counts:
            check(counts["/state"] == counts["/energy"], "frames without a row")
        check(sum(counts.values()) == summary.statistics.message_count, "the statistics disagree")

    low, high = (
        (np.min([b[0] for b in bounds], axis=0), np.max([b[1] for b in bounds], axis=0))
        if bounds
        else ([], [])
    )
    report = {
        "messages": counts,
        "encodings": sorted(encoded),
        "vertices": vertices,
        "attachments": {name: len(data) for name, data in attachments.items()},
        "bounds": [list(map(float, low)), list(map(float, high))],
        "outcome": metadata["outcome"],
    }
    print(json.dumps(report, indent=1))


if __name__ == "__main__":
    main()
