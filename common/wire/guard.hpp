// Bytes from the bus, checked before they are decoded.
//
// The decoders that lcm-gen writes allocate what a count promises and throw inside C frames on a
// negative one. So the bytes are walked against the type's layout first: after that, decoding can
// neither fail nor need more than four times the message's size. All numbers are checked to be
// finite in the same walk.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/wire/layout.hpp"
#include "common/wire/result.hpp"

namespace understory::wire {

/// A whole encoded message, fingerprint included.
using Bytes = std::vector<std::uint8_t>;

/// Why `bytes` are no whole, well-formed message of this type; none = they are. The fingerprint is
/// part of the bytes.
std::optional<Refusal> check_bytes(std::span<const std::uint8_t> bytes, const WireType& type);

/// First fields of every message.
struct MessageHeader {
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
};

/// The first eight bytes, LCM's hash of the type; none where there are fewer.
std::optional<std::int64_t> fingerprint_of(std::span<const std::uint8_t> bytes);
/// `utime` and `seq` behind the fingerprint; none where the bytes are too few. Nothing is checked.
std::optional<MessageHeader> header_of(std::span<const std::uint8_t> bytes);

namespace internal {
/// The table entry of this name; throws std::logic_error where there is none.
const WireType& required_wire_type(std::string_view name);
}  // namespace internal

/// The table entry of a generated type; throws std::logic_error for one that lcmtypes/ lacks.
template <class Message>
const WireType& wire_type_of() {
  static const WireType& type = internal::required_wire_type(Message::getTypeName());
  return type;
}

/// Bytes of one T within another message; T has a constant size.
template <class T>
std::size_t element_bytes() {
  return static_cast<std::size_t>(T{}.getEncodedSize()) - sizeof(std::int64_t);
}

/// Bytes of a Message whose only list has so many Elements of a constant size.
template <class Message, class Element>
std::size_t bytes_with(std::size_t elements) {
  return static_cast<std::size_t>(Message{}.getEncodedSize()) + elements * element_bytes<Element>();
}

/// Checks the bytes, then decodes them. Time and memory are linear in their number.
template <class Message>
Result<Message> decode_bytes(std::span<const std::uint8_t> bytes) {
  if (auto refusal = check_bytes(bytes, wire_type_of<Message>())) return *std::move(refusal);
  Message message{};
  const int size = static_cast<int>(bytes.size());
  if (message.decode(bytes.data(), 0, size) != size) {
    return Refusal{Reason::kInconsistent, "the decoder disagrees with the layout"};
  }
  return message;
}

/// A wire type to bytes; cannot fail.
template <class Message>
Bytes encode_bytes(const Message& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace understory::wire
