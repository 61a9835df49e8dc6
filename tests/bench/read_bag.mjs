// Prints each message of an MCAP file as a line of JSON, read as Foxglove reads it.
import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import rosmsg from "@foxglove/rosmsg";
import serialization from "@foxglove/rosmsg2-serialization";
import { decompress } from "fzstd";

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(offset));
    return bytes;
  },
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: { zstd: (data) => decompress(data) } });
const readers = new Map();
const plain = (key, value) => (ArrayBuffer.isView(value) ? [...value] : typeof value === "bigint" ? Number(value) : value);
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  if (!readers.has(schema.id)) {
    const definition = rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true });
    readers.set(schema.id, new serialization.MessageReader(definition));
  }
  const fields = readers.get(schema.id).readMessage(message.data);
  console.log(JSON.stringify({ topic: channel.topic, kind: schema.name, fields }, plain));
}
