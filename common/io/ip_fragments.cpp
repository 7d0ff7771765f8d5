#include "common/io/ip_fragments.hpp"

#include <algorithm>
#include <cstdlib>

namespace understory::io {
namespace {

/// Identifications repeat after 65,536 datagrams: 50 s of a laser that sends 1,280 per second.
constexpr model::Utime kLongestWait_us = 2'000'000;
constexpr std::size_t kMostPending = 64;
constexpr std::size_t kLargestDatagram = 65'535;

}  // namespace

std::optional<std::vector<std::uint8_t>> IpReassembler::Parts::joined() const {
  if (!size) return std::nullopt;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(*size);
  for (const auto& [offset, part] : by_offset) {
    if (offset != bytes.size()) return std::nullopt;
    bytes.insert(bytes.end(), part.begin(), part.end());
  }
  if (bytes.size() != *size) return std::nullopt;
  return bytes;
}

void IpReassembler::drop_stale(model::Utime utime) {
  dropped_ += std::erase_if(pending_, [&](const auto& entry) {
    return std::abs(utime - entry.second.begun) > kLongestWait_us;
  });
  if (pending_.size() < kMostPending) return;
  pending_.erase(
      std::ranges::min_element(pending_, {}, [](const auto& entry) { return entry.second.begun; }));
  ++dropped_;
}

std::optional<std::vector<std::uint8_t>> IpReassembler::add(const IpFragment& fragment,
                                                            model::Utime utime) {
  const Key key{fragment.sender, fragment.receiver, fragment.identification};
  const std::size_t end = fragment.offset + fragment.bytes.size();
  if (fragment.bytes.empty() || end > kLargestDatagram) {
    dropped_ += pending_.erase(key);
    return std::nullopt;
  }

  drop_stale(utime);
  Parts& parts = pending_.try_emplace(key, Parts{utime, {}, {}}).first->second;
  parts.by_offset.try_emplace(fragment.offset, fragment.bytes.begin(), fragment.bytes.end());
  if (fragment.is_last) parts.size = end;

  auto datagram = parts.joined();
  if (datagram) pending_.erase(key);
  return datagram;
}

}  // namespace understory::io
