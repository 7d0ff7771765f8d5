#include "common/bus/state_format.hpp"

namespace understory::bus {
namespace {

constexpr std::string_view kSnapshotMagic = "understory-snapshot";
constexpr std::uint32_t kSnapshotVersion = 1;
constexpr std::uint64_t kLargestEvent = std::uint64_t{1} << 29U;

void put(std::string& out, std::uint64_t value, std::size_t size) {
  for (std::size_t i = size; i-- > 0;) out.push_back(static_cast<char>(value >> (8U * i)));
}

/// Takes a big-endian number from the front; the caller has checked the size.
std::uint64_t take(std::string_view& bytes, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    value = (value << 8U) | static_cast<std::uint8_t>(bytes[i]);
  }
  bytes.remove_prefix(size);
  return value;
}

}  // namespace

std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char byte : bytes) {
    hash = (hash ^ static_cast<std::uint8_t>(byte)) * 1099511628211ULL;
  }
  return hash;
}

std::string encode_snapshot(std::uint64_t generation, std::string_view state) {
  std::string out(kSnapshotMagic);
  put(out, kSnapshotVersion, 4);
  put(out, generation, 8);
  put(out, state.size(), 8);
  put(out, checksum(state), 8);
  out.append(state);
  // The checksum covers the header's numbers too.
  put(out, checksum(out), 8);
  return out;
}

wire::Result<Snapshot> decode_snapshot(std::string_view bytes) {
  const auto damaged = [](const char* what) {
    return wire::Refusal{wire::Reason::kSnapshotDamaged, what};
  };

  if (bytes.size() < kSnapshotMagic.size() + 36) return damaged("too short");
  const std::string_view covered = bytes.substr(0, bytes.size() - 8);
  std::string_view tail = bytes.substr(bytes.size() - 8);
  if (!bytes.starts_with(kSnapshotMagic)) return damaged("not a snapshot");
  if (take(tail, 8) != checksum(covered)) return damaged("the checksum does not fit");

  bytes.remove_prefix(kSnapshotMagic.size());
  if (take(bytes, 4) != kSnapshotVersion) return damaged("of another version");

  Snapshot snapshot;
  snapshot.generation = take(bytes, 8);
  const std::uint64_t size = take(bytes, 8);
  const std::uint64_t sum = take(bytes, 8);
  bytes.remove_suffix(8);
  if (bytes.size() != size || checksum(bytes) != sum) return damaged("the state is not whole");

  snapshot.state = std::string(bytes);
  return snapshot;
}

std::string encode_event(std::string_view channel, std::span<const std::uint8_t> bytes) {
  std::string body;
  put(body, channel.size(), 2);
  body.append(channel);
  body.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::string out;
  put(out, body.size(), 4);
  put(out, checksum(body), 8);
  return out + body;
}

JournalContent decode_journal(std::string_view bytes) {
  JournalContent content;
  while (!bytes.empty()) {
    std::string_view rest = bytes;
    if (rest.size() < 12) {
      content.is_torn = true;
      break;
    }

    const std::uint64_t size = take(rest, 4);
    const std::uint64_t sum = take(rest, 8);
    if (size < 2 || size > kLargestEvent) {
      content.is_damaged = true;
      break;
    }

    if (rest.size() < size) {
      content.is_torn = true;
      break;
    }

    std::string_view body = rest.substr(0, size);
    if (checksum(body) != sum) {
      content.is_damaged = true;
      break;
    }

    const std::uint64_t letters = take(body, 2);
    if (letters > body.size()) {
      content.is_damaged = true;
      break;
    }

    JournalEvent event{std::string(body.substr(0, letters)), {}};
    event.bytes.assign(body.begin() + static_cast<std::ptrdiff_t>(letters), body.end());
    content.events.push_back(std::move(event));
    content.valid_bytes += 12 + size;
    bytes = rest.substr(size);
  }

  return content;
}

}  // namespace understory::bus
