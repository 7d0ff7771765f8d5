// The inputs of a drive as a log, with its truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include "common/geometry/se2.hpp"
#include "common/io/lcm_log.hpp"
#include "common/model/landmarks.hpp"

namespace understory::eval::harness {

/// Keeps what goes into a chain, so that the drive can be replayed.
class InputLog {
 public:
  /// An empty path: keeps nothing. Makes the folder. Throws io::LogError or
  /// std::filesystem::filesystem_error where the file cannot be written.
  explicit InputLog(const std::filesystem::path& file);

  void add(model::Utime utime, std::string_view channel, std::span<const std::uint8_t> bytes);
  /// A true pose, as GROUND_TRUTH.
  void add_truth(model::Utime utime, const geometry::SE2& world_T_vehicle);
  /// Gives the file its name. Throws io::LogError.
  void finish();

 private:
  std::optional<io::LcmLogWriter> writer_;
  std::int64_t truths_ = 0;
};

}  // namespace understory::eval::harness
