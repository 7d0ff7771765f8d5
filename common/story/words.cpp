#include "common/story/words.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace understory::story {

std::string when(model::Utime utime, model::Utime start) {
  return fmt::format("{:.3f} s (utime {})",
                     1e-6 * (static_cast<double>(utime) - static_cast<double>(start)), utime);
}

std::string landmark_name(model::LandmarkId id) {
  const std::uint64_t counter = id & ((std::uint64_t{1} << model::kLandmarkCounterBits) - 1);
  return fmt::format("{}:{}", model::map_of(id), counter);
}

std::string landmark_name_and_id(model::LandmarkId id) {
  return fmt::format("{} ({})", landmark_name(id), static_cast<std::int64_t>(id));
}

std::string place_words(const Eigen::Vector2d& place_m) {
  return fmt::format("x {:.2f} m, y {:.2f} m", place_m.x(), place_m.y());
}

std::string sigma_words(const Eigen::Matrix2d& covariance_m2) {
  if (covariance_m2.isZero(0.0)) return "sigma not told";
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  const Eigen::Vector2d sigmas_m = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return fmt::format("sigma {:.3f} m and {:.3f} m", sigmas_m.y(), sigmas_m.x());
}

std::string_view status_words(model::MapUpdateStatus status) {
  switch (status) {
    case model::MapUpdateStatus::kFirstMap:
      return "first of its map";
    case model::MapUpdateStatus::kUpdated:
      return "localised and fused";
    case model::MapUpdateStatus::kNotSure:
      return "not sure where it is";
    case model::MapUpdateStatus::kRolledBack:
      return "fused, contradicted the map, taken back";
    case model::MapUpdateStatus::kRejected:
      return "rejected";
  }
  return "of an unknown status";
}

std::string status_words(const model::SlamPose& pose) {
  if (!pose.status) {
    return pose.is_coasting ? "coasting: too few landmarks match, by odometry alone"
                            : "tracked between keyframes: its landmarks match the map as it was";
  }
  switch (*pose.status) {
    case model::MapUpdateStatus::kFirstMap:
      return pose.is_new_map ? "new map: begun beside another one, which is not continued"
                             : "first map: its keyframe began the map";
    case model::MapUpdateStatus::kUpdated:
      return "localised: its keyframe was found in the map and fused";
    case model::MapUpdateStatus::kNotSure:
      return pose.is_lost ? "lost: no place is certain, and odometry does not reach here; the pose "
                            "means nothing"
                          : "not sure: no place is certain; the pose means nothing";
    case model::MapUpdateStatus::kRolledBack:
      return "rolled back: its keyframe contradicted the map; the pose means nothing";
    case model::MapUpdateStatus::kRejected:
      return "rejected: its keyframe was malformed, empty or out of order; the pose means nothing";
  }
  return "of an unknown status";
}

std::string counted(std::uint64_t number, std::string_view noun) {
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

std::string dropped_words(std::string_view what, std::uint64_t number) {
  return number == 0 ? "" : fmt::format("earlier {} were dropped: {}", what, number);
}

}  // namespace understory::story
