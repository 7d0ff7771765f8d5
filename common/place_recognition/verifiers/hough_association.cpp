#include "common/place_recognition/verifiers/hough_association.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>

#include "common/place_recognition/verifiers/correspondence_graph.hpp"

namespace understory::place_recognition::verifiers {
namespace {

/// Votes for motions within limits; ordered by heading, then x.
class Accumulator {
 public:
  explicit Accumulator(const HoughParameters& parameters)
      : cell_m_(parameters.cell_m),
        bound_m_(parameters.max_distance_m),
        side_(static_cast<std::size_t>(std::ceil(2.0 * bound_m_ / cell_m_))),
        headings_(static_cast<std::size_t>(
            std::max(1.0, std::round(2.0 * std::numbers::pi / parameters.cell_rad)))),
        votes_(headings_ * side_ * side_, 0) {}

  std::size_t headings() const { return headings_; }
  double heading_rad(std::size_t heading) const {
    return 2.0 * std::numbers::pi * static_cast<double>(heading) / static_cast<double>(headings_);
  }

  void vote(std::size_t heading, const Eigen::Vector2d& translation_m) {
    const double x = (translation_m.x() + bound_m_) / cell_m_;
    const double y = (translation_m.y() + bound_m_) / cell_m_;
    const auto side = static_cast<double>(side_);
    if (!(x >= 0.0 && x < side && y >= 0.0 && y < side)) return;
    ++votes_[(heading * side_ + static_cast<std::size_t>(x)) * side_ + static_cast<std::size_t>(y)];
  }

  /// The cells of most votes.
  std::vector<HoughCell> best(std::size_t most) const {
    std::vector<std::size_t> cells;
    for (std::size_t cell = 0; cell < votes_.size(); ++cell) {
      if (votes_[cell] >= 2) cells.push_back(cell);
    }
    const std::size_t kept = std::min(most, cells.size());
    std::partial_sort(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(kept), cells.end(),
                      [&](std::size_t a, std::size_t b) {
                        return std::tuple(votes_[b], a) < std::tuple(votes_[a], b);
                      });
    std::vector<HoughCell> found;
    found.reserve(kept);
    for (std::size_t i = 0; i < kept; ++i) found.push_back({middle(cells[i]), votes_[cells[i]]});
    return found;
  }

 private:
  geometry::SE2 middle(std::size_t cell) const {
    const auto at = [&](std::size_t index) {
      return (static_cast<double>(index) + 0.5) * cell_m_ - bound_m_;
    };
    return {at(cell / side_ % side_), at(cell % side_), heading_rad(cell / (side_ * side_))};
  }

  double cell_m_;
  double bound_m_;
  std::size_t side_;
  std::size_t headings_;
  std::vector<std::uint32_t> votes_;
};

}  // namespace

std::vector<HoughCell> hough_cells(const LandmarkSets& landmarks,
                                   const HoughParameters& parameters) {
  Accumulator accumulator(parameters);
  for (std::size_t heading = 0; heading < accumulator.headings(); ++heading) {
    const Eigen::Matrix2d rotation =
        geometry::SE2(0.0, 0.0, accumulator.heading_rad(heading)).rotation();
    for (const LevelStem& of_query : landmarks.query) {
      const Eigen::Vector2d turned = rotation * of_query.position_m;
      for (const LevelStem& of_frame : landmarks.frame)
        accumulator.vote(heading, of_frame.position_m - turned);
    }
  }
  return accumulator.best(parameters.most_cells);
}

std::optional<VerifiedPlace> HoughVerifier::verify(
    const PlaceFrame& query, const PlaceFrame& frame,
    std::span<const geometry::SE2WithCovariance> /*guesses*/) const {
  const auto of_query = nearest_landmarks(level_stems(query), parameters_.hough.most_landmarks);
  const auto of_frame = nearest_landmarks(level_stems(frame), parameters_.hough.most_landmarks);
  const LandmarkSets landmarks{of_query, of_frame};

  PairedPose best;
  for (const HoughCell& cell : hough_cells(landmarks, parameters_.hough)) {
    PairedPose pose = refined_pose(landmarks, cell.frame_T_query, parameters_.hough.gate_m);
    if (pose.pairs.size() > best.pairs.size()) best = std::move(pose);
  }
  return place_by_pairs(landmarks, best, parameters_);
}

}  // namespace understory::place_recognition::verifiers
