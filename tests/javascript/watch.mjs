// Foxglove's own client at a server: `node watch.mjs ADDRESS TOPIC COUNT`.
//
// Subscribes to a topic, prints COUNT of its messages, each as one line of JSON, then tries to publish
// on the topic and prints the server's answer.

import ws from "@foxglove/ws-protocol";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";
import WebSocket from "ws";

const [address, topic, count] = process.argv.slice(2);
const { FoxgloveClient } = ws;
const socket = new WebSocket(address, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const client = new FoxgloveClient({ ws: socket });
const print = (row) => process.stdout.write(`${JSON.stringify(row)}\n`);
const types = new Map();
let seen = 0;

client.on("serverInfo", (info) => print({ server: info.name, capabilities: info.capabilities }));
client.on("error", (error) => print({ error: String(error.message ?? error) }));
client.on("close", () => process.exit(0));
client.on("advertise", (channels) => {
  for (const channel of channels.filter((each) => each.topic === topic)) {
    const files = descriptor.FileDescriptorSet.decode(Buffer.from(channel.schema, "base64"));
    const type = protobuf.Root.fromDescriptor(files).lookupType(channel.schemaName);
    types.set(client.subscribe(channel.id), type);
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  if (seen === Number(count)) return;
  const type = types.get(subscriptionId);
  const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  const message = type.toObject(type.decode(bytes), { longs: String });
  print({ topic, time: String(timestamp), message });
  seen += 1;
  if (seen === Number(count)) {
    client.advertise({ topic, encoding: "protobuf", schemaName: "lariat.NodeChain" });
  }
});
client.on("status", (status) => {
  print({ status: status.message });
  socket.close();
});
