/**
 * Binary messages of the stream, the inverse of `view/codec.py`.
 *
 * A message is the length of a JSON header (uint32, little-endian), the header, and the bytes of
 * arrays, which begin at multiples of 8 bytes. Arrays may be compressed in the zlib format.
 */

const TYPES = {
  f4: Float32Array,
  f8: Float64Array,
  i1: Int8Array,
  u1: Uint8Array,
  i4: Int32Array,
};

/**
 * @typedef {{values: ArrayLike<number>, shape: number[]}} NumberArray
 * @typedef {{key: string, data: any, arrays: Object<string, NumberArray>}} Item
 */

/** Decode an ArrayBuffer to `{header, items, removed}`; throws if it is no message. */
export async function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const items = await Promise.all(
    (header.items ?? []).map(async ({ key, data, arrays }) => {
      const decoded = await Promise.all(
        arrays.map(async (described) => [
          described.name,
          await decodeArray(described, buffer, 4 + length),
        ]),
      );
      return { key, data, arrays: Object.fromEntries(decoded) };
    }),
  );
  return { header, items, removed: header.removed ?? [] };
}

async function decodeArray(described, buffer, start) {
  const Type = TYPES[described.type];
  if (!Type) {
    throw new Error(`${described.name}: type ${described.type} is unknown`);
  }
  let content = buffer;
  let first = start + described.offset;
  let bytes = described.bytes;
  if (described.deflated) {
    content = await inflate(new Uint8Array(buffer, first, bytes));
    first = 0;
    bytes = content.byteLength;
  }
  const values = new Type(content, first, bytes / Type.BYTES_PER_ELEMENT);
  const expected = described.shape.reduce((product, side) => product * side, 1);
  if (values.length !== expected) {
    throw new Error(`${described.name}: ${values.length} values, expected ${expected}`);
  }
  return { values, shape: described.shape };
}

async function inflate(compressed) {
  const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}
