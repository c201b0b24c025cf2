// Reads a recording with the reader inside Foxglove and Lichtblick: npm install @mcap/core @mcap/support @mcap/nodejs,
// in the directory from which this is run. Decodes every message of every topic and prints a JSON summary. The exit
// code is not 0 if anything is wrong.

import { open } from "node:fs/promises";
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(join(process.cwd(), "package.json"));
const { McapIndexedReader } = require("@mcap/core");
const { FileHandleReadable } = require("@mcap/nodejs");
const { loadDecompressHandlers, protobufFromBinaryDescriptor } = require("@mcap/support");

const path = process.argv[2];
function check(condition, what) {
  if (!condition) {
    throw new Error(`${path}: ${what}`);
  }
}

const file = await open(path, "r");
const decompressHandlers = await loadDecompressHandlers();
const readable = new FileHandleReadable(file);
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });

const metadata = {};
for await (const record of reader.readMetadata()) {
  metadata[record.name] = Object.fromEntries(record.metadata);
}
check(metadata.pliant && metadata.outcome, "metadata is missing");
const vertices = Number(metadata.pliant.vertex_count);

const attachments = {};
for await (const attachment of reader.readAttachments()) {
  attachments[attachment.name] = attachment.data.byteLength;
}

const decoders = new Map();
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  if (channel.messageEncoding === "protobuf") {
    const type = protobufFromBinaryDescriptor(schema.data).lookupType(schema.name);
    decoders.set(channel.id, (data) => type.decode(data));
  } else {
    decoders.set(channel.id, (data) => JSON.parse(new TextDecoder().decode(data)));
  }
}

const messages = {};
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const { topic } = reader.channelsById.get(message.channelId);
  const content = decoders.get(message.channelId)(message.data);
  messages[topic] = (messages[topic] ?? 0) + 1;
  if (topic === "/state") {
    check(content.point_stride === 48 && content.data.byteLength === 48 * vertices, "/state has the wrong size");
  } else if (topic === "/mesh") {
    for (const part of content.entities.flatMap((entity) => [...entity.triangles, ...entity.lines])) {
      check(part.indices.every((index) => index < part.points.length), "/mesh: index without a point");
    }
  } else if (topic === "/energy") {
    check(Number.isFinite(content.total), "/energy is not finite");
  }
}
for (const [id, count] of reader.statistics.channelMessageCounts) {
  check(BigInt(messages[reader.channelsById.get(id).topic] ?? 0) === count, "the statistics disagree");
}
console.log(JSON.stringify({ messages, vertices, attachments, outcome: metadata.outcome }, null, 1));
await file.close();
