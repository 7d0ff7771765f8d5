#include "common/io/packet_capture.hpp"

#include <fmt/format.h>
#include <pcap/pcap.h>

#include <array>
#include <span>

#include "common/io/data_error.hpp"

namespace understory::io {
namespace {

constexpr std::size_t kEthernetBytes = 14;
constexpr std::size_t kTagBytes = 4;
constexpr std::size_t kUdpBytes = 8;
constexpr std::uint16_t kIpv4 = 0x0800;
constexpr std::uint16_t kVlan = 0x8100;
constexpr std::uint8_t kUdp = 17;
constexpr std::size_t kMostTags = 2;

using Frame = std::span<const std::uint8_t>;

std::uint16_t network_word(Frame frame, std::size_t at) {
  return static_cast<std::uint16_t>((frame[at] << 8U) | frame[at + 1]);
}

/// Behind the Ethernet header: the IPv4 packet; empty where there is none.
Frame internet_packet(Frame frame) {
  std::size_t type_at = kEthernetBytes - 2;
  for (std::size_t tag = 0; tag <= kMostTags; ++tag) {
    if (type_at + 2 > frame.size()) return {};
    const std::uint16_t type = network_word(frame, type_at);
    if (type == kIpv4) return frame.subspan(type_at + 2);
    if (type != kVlan) return {};
    type_at += kTagBytes;
  }
  return {};
}

/// The UDP payload of an IPv4 packet that is no fragment.
std::optional<CapturedPacket> udp_payload(Frame packet) {
  if (packet.size() < 20 || packet[0] >> 4U != 4) return std::nullopt;
  const std::size_t header = 4U * (packet[0] & 0x0FU);
  const bool is_fragment = (network_word(packet, 6) & 0x3FFFU) != 0;
  if (header < 20 || packet[9] != kUdp || is_fragment || packet.size() < header + kUdpBytes)
    return std::nullopt;

  const Frame datagram = packet.subspan(header);
  const std::size_t length = network_word(datagram, 4);
  if (length < kUdpBytes || length > datagram.size()) return std::nullopt;

  const Frame payload = datagram.subspan(kUdpBytes, length - kUdpBytes);
  CapturedPacket result;
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
    if (!capture_) throw DataError(fmt::format("{}: {}", path_, error.data()));
    link_ = pcap_datalink(capture_.get());
    if (link_ != DLT_EN10MB && link_ != DLT_RAW)
      throw DataError(
          fmt::format("{}: link type {} is neither Ethernet nor raw IPv4", path_, link_));
  }

  std::optional<CapturedPacket> next() {
    pcap_pkthdr* header = nullptr;
    const u_char* data = nullptr;
    while (true) {
      const int status = pcap_next_ex(capture_.get(), &header, &data);
      if (status != 1) {
        is_cut_off_ = status == PCAP_ERROR;
        return std::nullopt;
      }

      ++counts_.frames;
      const Frame frame(data, header->caplen);
      auto packet = udp_payload(link_ == DLT_RAW ? frame : internet_packet(frame));

      if (!packet) {
        ++counts_.not_udp;
        continue;
      }

      packet->utime = static_cast<model::Utime>(header->ts.tv_sec) * 1'000'000 + header->ts.tv_usec;
      return packet;
    }
  }

  const CaptureCounts& counts() const { return counts_; }
  bool is_cut_off() const { return is_cut_off_; }

 private:
  struct Closer {
    void operator()(pcap_t* capture) const { pcap_close(capture); }
  };
  std::string path_;
  std::unique_ptr<pcap_t, Closer> capture_;
  int link_ = 0;
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
