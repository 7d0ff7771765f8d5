// Velodyne packets made up.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/io/velodyne.hpp"

namespace understory::test {

using Packet = std::vector<std::uint8_t>;

/// Data packets of a laser that rotates evenly and measures one distance everywhere.
struct PacketMaker {
  bool dual = false;
  bool hdl64 = false;
  std::uint8_t product = 0x22;
  int azimuth = 0;
  int azimuth_step = 40;  ///< From block to block (pair of blocks).
  std::uint16_t distance = 5000;
  double time_us = 1000.0;
  double packet_us = 1327.104;

  Packet next() {
    Packet packet(io::kVelodyneDataBytes, 0);
    const auto put = [&](std::size_t at, std::uint32_t value, int bytes) {
      for (int i = 0; i < bytes; ++i)
        packet[at + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(value >> (8 * i));
    };

    const int shared = (dual ? 2 : 1) * (hdl64 ? 2 : 1);
    for (int b = 0; b < 12; ++b) {
      const auto at = static_cast<std::size_t>(b) * 100;
      put(at, hdl64 && b % 2 == 1 ? 0xDDFF : 0xEEFF, 2);
      put(at + 2, static_cast<std::uint32_t>((azimuth + b / shared * azimuth_step) % 36000), 2);
      const bool second = dual && (b / (hdl64 ? 2 : 1)) % 2 == 1;
      for (std::size_t c = 0; c < 32; ++c) {
        put(at + 4 + 3 * c, distance + (second ? 500U : 0U), 2);
        packet[at + 6 + 3 * c] = static_cast<std::uint8_t>(c);
      }
    }

    put(1200, static_cast<std::uint32_t>(time_us), 4);
    packet[1204] = dual ? 0x39 : 0x37;
    packet[1205] = product;
    azimuth = (azimuth + 12 / shared * azimuth_step) % 36000;
    time_us += packet_us;

    return packet;
  }
};

/// A calibration of the HDL-64E.
inline std::string hdl64_yaml() {
  std::string text = "lasers:\n";
  for (int i = 0; i < 64; ++i)
    text += "- {dist_correction: 1.2, laser_id: " + std::to_string(i) +
            ", rot_correction: 0.01, vert_correction: " + std::to_string(0.05 - 0.007 * i) +
            ", horiz_offset_correction: 0.026, vert_offset_correction: 0.2}\n";
  return text;
}

}  // namespace understory::test
