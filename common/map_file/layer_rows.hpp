// Single features of the layers.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/map_file/connection.hpp"
#include "common/map_file/stored_map.hpp"

namespace understory::map_file {

/// Values of landmarks.kind.
inline constexpr std::string_view kTrunkText = "trunk";
inline constexpr std::string_view kCornerText = "corner";

/// Treatment of an existing landmark with the same id, in any map.
enum class SameLandmark : std::uint8_t { kRefused, kReplaced };

/// Writes landmarks.
class LandmarkRows {
 public:
  /// `connection` must outlive it.
  LandmarkRows(const Connection& connection, SameLandmark same);
  /// Precondition: the map's row exists. Fault::kRefused where the landmark exists and may not be
  /// replaced.
  void put(std::uint32_t map_id, const StoredLandmark& landmark);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

/// Writes keyframes; one of the same number is replaced.
class KeyframeRows {
 public:
  /// `connection` must outlive it.
  explicit KeyframeRows(const Connection& connection);
  /// Precondition: the map's row exists. Numbers grow with time.
  void put(std::int64_t number, std::uint32_t map_id, const model::KeyframePose& pose);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

/// Writes borders of submaps; one of the same number is replaced.
class BorderRows {
 public:
  /// `connection` must outlive it.
  explicit BorderRows(const Connection& connection);
  /// Precondition: the map's row exists.
  void put(std::int64_t number, std::uint32_t map_id, const SubmapBorder& border);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

/// Writes loop closures; one of the same number is replaced.
class LoopRows {
 public:
  /// `connection` must outlive it.
  explicit LoopRows(const Connection& connection);
  /// Precondition: the map's row exists.
  void put(std::int64_t number, std::uint32_t map_id, const LoopClosure& loop);

 private:
  Statement insert_;
  std::int32_t srs_id_;
};

}  // namespace understory::map_file
