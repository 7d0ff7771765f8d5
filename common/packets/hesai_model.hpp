// Models of Hesai: layout, beams, firing times.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace understory::packets {

/// The supported models.
enum class HesaiModel : std::uint8_t {
  kPandar40p,
  kPandar64,
  kPandarQt,
  kPandarXt16,
  kPandarXt32,
  kXt32m2x,
};
/// By name: "pandar40p", "pandar64", "pandarqt", "xt16", "xt32", "xt32m2x"; none for any other.
std::optional<HesaiModel> hesai_model(std::string_view name);
/// The name for hesai_model().
std::string_view to_string(HesaiModel model);

/// Direction of one beam.
struct HesaiBeam {
  double elevation_rad = 0.0;  ///< Upwards.
  double azimuth_rad = 0.0;    ///< Added to the block's azimuth; clockwise positive.
};

/// Layout of a model's packets [bytes], and its firing times.
struct HesaiFormat {
  std::size_t header = 0;       ///< Bytes before the first block.
  std::size_t blocks = 0;       ///< Blocks of a packet.
  std::size_t beams = 0;        ///< Beams of a block.
  std::size_t azimuth_at = 0;   ///< Offset of the azimuth in the block.
  std::size_t channels_at = 0;  ///< Offset of the channels in the block.
  std::size_t channel = 0;      ///< Bytes of one beam: distance, reflectivity and more.
  std::size_t tail = 0;         ///< Bytes of the tail, without the UDP sequence number.
  std::size_t time_at = 0;      ///< Offset of the microseconds in the tail.
  std::size_t date_at = 0;      ///< Offset of the UTC date and time in the tail.
  double first_block_us = 0.0;  ///< Start of the first block relative to the packet's time; of the
                                ///< last block if is_timed_from_last.
  double block_us = 0.0;        ///< Time between two firings of all beams.
  bool is_timed_from_last = true;  ///< The packet's time is that of its last block.
  std::vector<double> firing_us;   ///< Time of each beam after its block's start; may be negative.
  double max_range_m = 0.0;

  std::size_t block() const { return channels_at + beams * channel; }  ///< Bytes of a block.
  /// Bytes of a packet, with or without the sequence number.
  std::size_t packet(bool has_sequence) const {
    return header + blocks * block() + tail + (has_sequence ? 4U : 0U);
  }
};
/// Format from the maker's documents, which are cited at the constants.
HesaiFormat hesai_format(HesaiModel model);

/// Nominal angles of the model, in order of its channels.
std::vector<HesaiBeam> hesai_beams(HesaiModel model);
/// The sensor's own "angle correction file": a heading with Elevation and Azimuth [degrees], a line
/// for each channel. Throws DataError where it has another number of channels than the model.
std::vector<HesaiBeam> parse_hesai_angles(std::string_view text, HesaiModel model,
                                          const std::string& source);

/// The model of a packet; none for bytes that are not a packet of these models.
std::optional<HesaiModel> recognise_hesai(std::span<const std::uint8_t> bytes);

}  // namespace understory::packets
