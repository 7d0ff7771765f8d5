#include "common/io/packet_capture.hpp"

#include <fmt/format.h>
#include <pcap/pcap.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "common/io/data_error.hpp"
#include "common/io/ip_fragments.hpp"

namespace understory::io {
namespace {

constexpr std::size_t kTagBytes = 4;
constexpr std::size_t kLeastIpBytes = 20;
constexpr std::size_t kUdpBytes = 8;
constexpr std::uint16_t kIpv4 = 0x0800;
constexpr std::array<std::uint16_t, 3> kVlan = {0x8100, 0x88A8, 0x9100};  // IEEE 802.1Q, 802.1ad
constexpr std::uint8_t kUdp = 17;
constexpr std::size_t kMostTags = 2;
constexpr model::Utime kLatest_s = 4'000'000'000;  // the year 2096; later times are damage

using Frame = std::span<const std::uint8_t>;

std::uint16_t network_word(Frame frame, std::size_t at) {
  return static_cast<std::uint16_t>((frame[at] << 8U) | frame[at + 1]);
}

std::uint32_t network_long_word(Frame frame, std::size_t at) {
  return (static_cast<std::uint32_t>(network_word(frame, at)) << 16U) | network_word(frame, at + 2);
}

/// Header of the frames of a link type (www.tcpdump.org/linktypes.html).
struct LinkLayer {
  std::size_t header_bytes = 0;
  std::optional<std::size_t> type_at;  ///< Offset of the EtherType; none = always IP.
};

std::optional<LinkLayer> link_layer(int link) {
  switch (link) {
    case DLT_EN10MB:
      return LinkLayer{14, 12};
    case DLT_LINUX_SLL:
      return LinkLayer{16, 14};
    case DLT_LINUX_SLL2:
      return LinkLayer{20, 0};
    case DLT_NULL:
    case DLT_LOOP:
      return LinkLayer{4, std::nullopt};
    case DLT_RAW:
    case DLT_IPV4:
      return LinkLayer{0, std::nullopt};
    default:
      return std::nullopt;
  }
}

/// The IPv4 packet after the link's header and VLAN tags; empty = none.
Frame internet_packet(Frame frame, const LinkLayer& link) {
  if (frame.size() < link.header_bytes) return {};
  if (!link.type_at) return frame.subspan(link.header_bytes);
  std::uint16_t type = network_word(frame, *link.type_at);
  Frame rest = frame.subspan(link.header_bytes);

  for (std::size_t tag = 0; tag <= kMostTags; ++tag) {
    if (type == kIpv4) return rest;
    if (std::ranges::find(kVlan, type) == kVlan.end() || rest.size() < kTagBytes) return {};
    type = network_word(rest, kTagBytes - 2);
    rest = rest.subspan(kTagBytes);
  }
  return {};
}

/// An IPv4 packet that carries UDP or a fragment of it; none for others.
std::optional<IpFragment> ip_fragment(Frame packet) {
  if (packet.size() < kLeastIpBytes || packet[0] >> 4U != 4) return std::nullopt;
  const std::size_t header = 4U * (packet[0] & 0x0FU);
  // Frames are padded to 60 bytes; a total of 0 means that the network card sets it.
  const std::size_t told = network_word(packet, 2);
  const std::size_t size = told == 0 ? packet.size() : told;
  if (header < kLeastIpBytes || packet[9] != kUdp || size > packet.size() || size < header)
    return std::nullopt;

  constexpr std::uint16_t kMoreFragments = 0x2000;
  constexpr std::uint16_t kOffset = 0x1FFF;  // in units of 8 bytes
  const std::uint16_t flags = network_word(packet, 6);
  return IpFragment{network_long_word(packet, 12), network_long_word(packet, 16),
                    network_word(packet, 4),       8U * static_cast<std::size_t>(flags & kOffset),
                    (flags & kMoreFragments) == 0, packet.subspan(header, size - header)};
}

std::optional<CapturedPacket> udp_payload(Frame datagram) {
  if (datagram.size() < kUdpBytes) return std::nullopt;
  const std::size_t length = network_word(datagram, 4);
  if (length < kUdpBytes || length > datagram.size()) return std::nullopt;

  const Frame payload = datagram.subspan(kUdpBytes, length - kUdpBytes);
  CapturedPacket result;
  result.source_port = network_word(datagram, 0);
  result.port = network_word(datagram, 2);
  result.payload.assign(payload.begin(), payload.end());
  return result;
}

}  // namespace

class PacketCapture::Impl {
 public:
  explicit Impl(const std::filesystem::path& path) : path_(path.string()) {
    std::array<char, PCAP_ERRBUF_SIZE> error{};
    capture_.reset(pcap_open_offline(path_.c_str(), error.data()));
    const std::string_view what(error.data());
    // libpcap names the file in some of its messages.
    if (!capture_)
      throw DataError(what.starts_with(path_) ? std::string(what)
                                              : fmt::format("{}: {}", path_, what));
    const int type = pcap_datalink(capture_.get());
    if (!link_layer(type))
      throw DataError(
          fmt::format("{}: link type {} is neither Ethernet nor Linux cooked, loopback or raw IPv4",
                      path_, type));
    link_type_ = type;
  }

  std::optional<CapturedPacket> next() {
    pcap_pkthdr* header = nullptr;
    const u_char* data = nullptr;
    while (true) {
      const int status = pcap_next_ex(capture_.get(), &header, &data);
      if (status != 1) {
        is_cut_off_ = status == PCAP_ERROR;
        counts_.incomplete = fragments_.dropped() + fragments_.pending();
        return std::nullopt;
      }

      ++counts_.frames;
      const auto seconds = std::clamp<model::Utime>(header->ts.tv_sec, 0, kLatest_s);
      const model::Utime utime = seconds * 1'000'000 + header->ts.tv_usec;
      auto packet = take(Frame(data, header->caplen), utime);
      if (!packet) continue;
      packet->utime = utime;
      return packet;
    }
  }

  const CaptureCounts& counts() const { return counts_; }
  bool is_cut_off() const { return is_cut_off_; }

 private:
  struct Closer {
    void operator()(pcap_t* capture) const { pcap_close(capture); }
  };

  /// The UDP packet in this frame, or completed by it.
  std::optional<CapturedPacket> take(Frame frame, model::Utime utime) {
    const auto fragment = ip_fragment(internet_packet(frame, *link_layer(link_type_)));
    std::optional<CapturedPacket> packet;
    if (fragment && fragment->offset == 0 && fragment->is_last) {
      packet = udp_payload(fragment->bytes);
    } else if (fragment) {
      ++counts_.fragments;
      const auto datagram = fragments_.add(*fragment, utime);
      counts_.incomplete = fragments_.dropped();
      if (!datagram) return std::nullopt;
      packet = udp_payload(*datagram);
    }

    if (packet) packet->sender = fragment->sender;
    return packet;
  }

  std::string path_;
  std::unique_ptr<pcap_t, Closer> capture_;
  int link_type_ = 0;
  IpReassembler fragments_;
  CaptureCounts counts_;
  bool is_cut_off_ = false;
};

PacketCapture::PacketCapture(const std::filesystem::path& path)
    : impl_(std::make_unique<Impl>(path)) {}
PacketCapture::~PacketCapture() = default;
PacketCapture::PacketCapture(PacketCapture&&) noexcept = default;
PacketCapture& PacketCapture::operator=(PacketCapture&&) noexcept = default;
std::optional<CapturedPacket> PacketCapture::next() { return impl_->next(); }
const CaptureCounts& PacketCapture::counts() const { return impl_->counts(); }
bool PacketCapture::is_cut_off() const { return impl_->is_cut_off(); }

}  // namespace understory::io
