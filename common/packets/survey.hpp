// Contents of a capture: senders, ports and makers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/io/packet_capture.hpp"

namespace understory::packets {

/// Apparent kind of a flow's packets.
enum class Kind : std::uint8_t {
  kUnknown,
  kPoints,
  kImu,
  kPosition,  ///< Sentences of a GNSS receiver.
};

/// A guess from the bytes and the port of one packet.
struct Recognised {
  Kind kind = Kind::kUnknown;
  std::string model;  ///< A name for make_decoder(); empty = unknown.
  std::string text;   ///< For people: "Ouster lidar packet, 128 beams, legacy".
};
/// Never throws; cost O(1) in the number of points.
Recognised recognise(const io::CapturedPacket& packet);

/// Packets from one sender to one port.
struct Flow {
  std::uint32_t sender = 0;  ///< IPv4, host's byte order.
  std::uint16_t port = 0;    ///< UDP, destination.
  std::uint64_t packets = 0;
  std::map<std::size_t, std::uint64_t> sizes;  ///< [bytes] and how many; at most 20 sizes.
  Recognised recognised;                       ///< Guess from the first recognised packet.
};

/// The flows of a capture, those with the most packets first.
struct Survey {
  std::vector<Flow> flows;
  double duration_s = 0.0;    ///< Time from the first packet to the last.
  bool is_whole_file = true;  ///< True: the whole file was read.
};
/// Reads at most `most_packets` (0 = all). Throws DataError.
Survey survey_capture(const std::filesystem::path& path, std::uint64_t most_packets = 0);

/// "192.168.1.201".
std::string address_text(std::uint32_t address);
/// A line for each flow: sender, port, packets, sizes, apparent kind.
std::string survey_text(const Survey& survey);

}  // namespace understory::packets
