// Captures made up: pcap and pcapng files of any link type, with VLAN tags and fragments.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "tests/io/log_fixture.hpp"

namespace understory::test {

/// How a capture is written.
struct CaptureStyle {
  enum class File { kPcap, kPcapNanoseconds, kPcapng };
  enum class Link { kEthernet, kVlan, kTwoVlans, kSll, kSll2, kLoopback, kRaw };
  File file = File::kPcap;
  Link link = Link::kEthernet;
  std::size_t mtu = 1500;  ///< Larger IPv4 packets go in fragments.
  bool shuffles_fragments = false;
};

/// Writes a capture packet by packet.
class CaptureFile {
 public:
  explicit CaptureFile(CaptureStyle style = {}) : style_(style) { begin(); }

  /// `from`, `port`: the sender's address and the destination. `lost_fragment`: the number of a
  /// fragment that is not captured.
  void add(std::int64_t utime, std::uint32_t from, std::uint16_t port,
           std::span<const std::uint8_t> payload, int lost_fragment = -1) {
    Bytes datagram;
    append_big(datagram, 50'000, 2);
    append_big(datagram, port, 2);
    append_big(datagram, payload.size() + 8, 2);
    append_big(datagram, 0, 2);
    datagram.insert(datagram.end(), payload.begin(), payload.end());

    std::vector<Bytes> packets;
    const std::size_t most = (style_.mtu - 20) / 8 * 8;
    for (std::size_t at = 0; at < datagram.size(); at += most) {
      const std::size_t size = std::min(most, datagram.size() - at);
      if (static_cast<int>(packets.size()) == lost_fragment) {
        lost_fragment = -1;
        continue;
      }
      packets.push_back(
          ip_packet(from, at, at + size == datagram.size(), {datagram.data() + at, size}));
    }
    ++identification_;
    if (style_.shuffles_fragments) std::ranges::shuffle(packets, random_);
    for (const Bytes& packet : packets) add_frame(utime, packet);
  }
  /// A packet of another protocol.
  void add_noise(std::int64_t utime) {
    Bytes packet(60);
    for (auto& byte : packet) byte = static_cast<std::uint8_t>(random_());
    packet[0] = 0x60;
    add_frame(utime, packet);
  }
  const Bytes& bytes() const { return bytes_; }

 private:
  static void append(Bytes& to, std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  static void append_big(Bytes& to, std::uint64_t value, int size) {
    for (int i = size - 1; i >= 0; --i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }

  std::uint16_t link_type() const {
    switch (style_.link) {
      case CaptureStyle::Link::kSll:
        return 113;
      case CaptureStyle::Link::kSll2:
        return 276;
      case CaptureStyle::Link::kLoopback:
        return 0;
      case CaptureStyle::Link::kRaw:
        return 101;
      default:
        return 1;
    }
  }

  void begin() {
    if (style_.file == CaptureStyle::File::kPcapng) {
      append(bytes_, 0x0A0D0D0A, 4);  // section header
      append(bytes_, 28, 4);
      append(bytes_, 0x1A2B3C4D, 4);
      append(bytes_, 1, 4);
      append(bytes_, 0xFFFFFFFFFFFFFFFF, 8);
      append(bytes_, 28, 4);
      append(bytes_, 1, 4);  // interface description, microseconds
      append(bytes_, 20, 4);
      append(bytes_, link_type(), 4);
      append(bytes_, 0, 4);
      append(bytes_, 20, 4);
      return;
    }
    const bool is_ns = style_.file == CaptureStyle::File::kPcapNanoseconds;
    append(bytes_, is_ns ? 0xA1B23C4D : 0xA1B2C3D4, 4);
    append(bytes_, 2, 2);
    append(bytes_, 4, 2);
    append(bytes_, 0, 8);
    append(bytes_, 262'144, 4);
    append(bytes_, link_type(), 4);
  }

  Bytes ip_packet(std::uint32_t from, std::size_t offset, bool is_last,
                  std::span<const std::uint8_t> data) const {
    Bytes packet{0x45, 0};
    append_big(packet, 20 + data.size(), 2);
    append_big(packet, identification_, 2);
    append_big(packet, offset / 8 + (is_last ? 0 : 0x2000), 2);
    append_big(packet, 0x4011, 2);  // time to live, UDP
    append_big(packet, 0, 2);
    append_big(packet, from, 4);
    append_big(packet, 0x0A0000FF, 4);
    packet.insert(packet.end(), data.begin(), data.end());
    return packet;
  }

  Bytes framed(const Bytes& packet) const {
    Bytes frame;
    frame.reserve(packet.size() + 64);
    using Link = CaptureStyle::Link;
    if (style_.link <= Link::kTwoVlans) {
      frame.resize(12, 0x22);
      if (style_.link == Link::kTwoVlans) append_big(frame, 0x88A80007, 4);
      if (style_.link != Link::kEthernet) append_big(frame, 0x81000005, 4);
      append_big(frame, 0x0800, 2);
    } else if (style_.link == Link::kSll) {
      frame.resize(14, 0x22);
      append_big(frame, 0x0800, 2);
    } else if (style_.link == Link::kSll2) {
      append_big(frame, 0x0800, 2);
      frame.resize(20, 0x22);
    } else if (style_.link == Link::kLoopback) {
      append(frame, 2, 4);
    }
    frame.insert(frame.end(), packet.begin(), packet.end());
    // Ethernet's shortest frames are filled up.
    if (style_.link == Link::kEthernet && frame.size() < 60) frame.resize(60, 0);
    return frame;
  }

  void add_frame(std::int64_t utime, const Bytes& packet) {
    const Bytes frame = framed(packet);
    if (style_.file == CaptureStyle::File::kPcapng) {
      const std::size_t padded = (frame.size() + 3) / 4 * 4;
      append(bytes_, 6, 4);  // enhanced packet
      append(bytes_, 32 + padded, 4);
      append(bytes_, 0, 4);
      append(bytes_, static_cast<std::uint64_t>(utime) >> 32U, 4);
      append(bytes_, static_cast<std::uint64_t>(utime), 4);
      append(bytes_, frame.size(), 4);
      append(bytes_, frame.size(), 4);
      bytes_.insert(bytes_.end(), frame.begin(), frame.end());
      bytes_.resize(bytes_.size() + padded - frame.size(), 0);
      append(bytes_, 32 + padded, 4);
      return;
    }
    const bool is_ns = style_.file == CaptureStyle::File::kPcapNanoseconds;
    append(bytes_, static_cast<std::uint64_t>(utime / 1'000'000), 4);
    append(bytes_, static_cast<std::uint64_t>(utime % 1'000'000) * (is_ns ? 1000 : 1), 4);
    append(bytes_, frame.size(), 4);
    append(bytes_, frame.size(), 4);
    bytes_.insert(bytes_.end(), frame.begin(), frame.end());
  }

  CaptureStyle style_;
  Bytes bytes_;
  std::uint16_t identification_ = 65'500;
  std::mt19937_64 random_{9};
};

/// Every way to write one.
inline std::vector<CaptureStyle> capture_styles() {
  using File = CaptureStyle::File;
  using Link = CaptureStyle::Link;
  std::vector<CaptureStyle> styles;
  for (const File file : {File::kPcap, File::kPcapNanoseconds, File::kPcapng}) {
    for (const Link link : {Link::kEthernet, Link::kVlan, Link::kTwoVlans, Link::kSll, Link::kSll2,
                            Link::kLoopback, Link::kRaw})
      styles.push_back({file, link, styles.size() % 2 == 0 ? 1500U : 576U, styles.size() % 3 == 0});
  }
  return styles;
}

}  // namespace understory::test
