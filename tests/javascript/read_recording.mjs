// Prints every message of a recording as one line of JSON: `node read_recording.mjs FILE`.

import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { decompress } from "fzstd";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await file.read(bytes, 0, bytes.length, Number(offset));
    return bytes;
  },
};
const decompressHandlers = { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });

const types = new Map();
function typeOf(schema) {
  if (!types.has(schema.id)) {
    const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
    types.set(schema.id, root.lookupType(schema.name));
  }
  return types.get(schema.id);
}

for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const row = {
    topic: channel.topic,
    publisher: channel.metadata.get("publisher") ?? "",
    sequence: message.sequence,
    log_time: String(message.logTime),
    publish_time: String(message.publishTime),
    schema: schema.name,
  };
  if (schema.encoding === "protobuf") {
    const type = typeOf(schema);
    const options = { longs: String, enums: String, bytes: String, json: true };
    row.message = type.toObject(type.decode(message.data), options);
  } else {
    row.message = Buffer.from(message.data).toString("base64");
  }
  process.stdout.write(`${JSON.stringify(row)}\n`);
}
await file.close();
