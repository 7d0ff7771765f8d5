// Single features of the layers.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/map_file/connection.hpp"
#include "common/map_file/stored_map.hpp"

namespace understory::map_file {

/// landmarks.kind.
inline constexpr std::string_view kTrunkText = "trunk";
inline constexpr std::string_view kCornerText = "corner";

/// What happens where a landmark of the same id is there, whatever map it is of.
enum class SameLandmark : std::uint8_t { kRefused, kReplaced };

/// Writes landmarks.
class LandmarkRows {
 public:
  /// `connection` outlives it.
  LandmarkRows(const Connection& connection, SameLandmark same);
  /// The map's row is there. Fault::kRefused where the landmark is and may not be replaced.
  void put(std::uint32_t map_id, const StoredLandmark& landmark);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

/// Writes keyframes; one of the same number is replaced.
class KeyframeRows {
 public:
  /// `connection` outlives it.
  explicit KeyframeRows(const Connection& connection);
  /// The map's row is there. Numbers grow with time.
  void put(std::int64_t number, std::uint32_t map_id, const model::KeyframePose& pose);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

/// Writes borders of submaps; one of the same number is replaced.
class BorderRows {
 public:
  /// `connection` outlives it.
  explicit BorderRows(const Connection& connection);
  /// The map's row is there.
  void put(std::int64_t number, std::uint32_t map_id, const SubmapBorder& border);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

/// Writes loop closures; one of the same number is replaced.
class LoopRows {
 public:
  /// `connection` outlives it.
  explicit LoopRows(const Connection& connection);
  /// The map's row is there.
  void put(std::int64_t number, std::uint32_t map_id, const LoopClosure& loop);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

}  // namespace understory::map_file
