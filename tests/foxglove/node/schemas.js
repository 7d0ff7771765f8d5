// The makers' schemas, and what agrees with them.
"use strict";
const Ajv = require("ajv").default;
const published = require("@foxglove/schemas/jsonschema");

/** The makers' schema of a name such as foxglove.Log; none for our own. */
function publishedSchema(name) {
  return name.startsWith("foxglove.") ? published[name.slice("foxglove.".length)] : undefined;
}

const ajv = new Ajv({ strict: false });
const validators = new Map();

/** Throws where the message does not agree with the schema (the makers' own, where they have one). */
function validate(name, ownSchema, message) {
  if (!validators.has(name)) validators.set(name, ajv.compile(publishedSchema(name) ?? ownSchema));
  const validator = validators.get(name);
  if (!validator(message)) throw new Error(`${name}: ${ajv.errorsText(validator.errors)}`);
}

module.exports = { publishedSchema, validate };
