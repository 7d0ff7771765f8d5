// eval shared-errors: drives through surveyed stems.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/model/stem_frame.hpp"
#include "sim/stem_frames.hpp"

namespace understory::eval::experiments::shared_errors {

/// A surveyed map and how it is driven through.
struct SurveyedDrive {
  std::string name;
  std::string map;          ///< CSV file below the folder of recordings.
  std::string diameter_cm;  ///< Column, where there is no dbh_m; rows without are left out.
  std::string way;          ///< laps, wander, or a CSV file with a recorded way there.
  double length_m = 0.0;    ///< Of the way, where it is not recorded.
  sim::StemDriveParameters drive;
};

/// The six of `eval loops`, and one with two or three stems ahead in a frame ("longleaf-few").
std::vector<SurveyedDrive> surveyed_drives();
/// Those drives that are meant where none is named: the six.
std::span<const std::string> usual_drives();

/// Which errors of the recorded walk (sim::measured_shared_errors()) frames share. The power of
/// those that are off is white noise instead; the bias of ranges has none that counts.
struct StemErrors {
  bool along = false;      ///< Correlated along the path.
  bool direction = false;  ///< By the direction of view.
  bool range = false;      ///< Ranges that are too short.
};
/// "shared" (all), "along", "direction", "range", "independent" (none); none for another name.
std::optional<StemErrors> stem_errors(std::string_view name);
/// The detector with these errors.
sim::StemDetectorParameters with_errors(sim::StemDetectorParameters detector, StemErrors errors);

/// Surveyed stems and, where the way is recorded, its places.
struct Survey {
  sim::Forest forest;
  std::vector<Eigen::Vector2d> recorded_m;
};
/// Reads what the drive needs. Throws std::runtime_error naming the file.
Survey read_survey(const SurveyedDrive& drive, const std::filesystem::path& data);

/// The frames of a drive; the same arguments give the same frames. Throws std::runtime_error where
/// the way does not fit.
std::vector<model::StemFrame> drive_frames(const SurveyedDrive& drive, const Survey& survey,
                                           StemErrors errors, std::uint64_t seed);

}  // namespace understory::eval::experiments::shared_errors
