// Our schemas are those of @foxglove/schemas, but for the descriptions.
"use strict";
const assert = require("node:assert");
const { openIndexed } = require("./mcap_file");
const { publishedSchema } = require("./schemas");

function withoutWords(value) {
  if (Array.isArray(value)) return value.map(withoutWords);
  if (value === null || typeof value !== "object") return value;
  const kept = Object.entries(value).filter(([key, one]) => key !== "$comment" && !(key === "description" && typeof one === "string"));
  return Object.fromEntries(kept.map(([key, one]) => [key, withoutWords(one)]));
}

async function main() {
  const reader = await openIndexed(process.argv[2]);
  let compared = 0;
  for (const schema of reader.schemasById.values()) {
    assert.equal(schema.encoding, "jsonschema");
    const own = JSON.parse(new TextDecoder().decode(schema.data));
    assert.equal(own.title, schema.name);
    if (!schema.name.startsWith("foxglove.")) continue;
    assert.deepStrictEqual(own, withoutWords(publishedSchema(schema.name)), schema.name);
    compared += 1;
  }
  assert.equal(compared, 8);
  console.log(`schemas: ${compared} agree with @foxglove/schemas`);
}

main();
