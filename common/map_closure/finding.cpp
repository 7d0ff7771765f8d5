#include "common/map_closure/finding.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace understory::map_closure {
namespace {

/// Lengths of path to both sides, tried one after the other [m].
constexpr std::array<double, 4> kReaches_m{0.0, 30.0, 60.0, 120.0};
/// Number of parts between the two that neither window contains.
constexpr std::size_t kBetween = 1;
constexpr double kPlaceSigma_m = 0.05;
constexpr double kPlaceSigma_rad = 0.003;

/// Parts [first, last] whose landmarks are used for one of the two.
struct Window {
  std::size_t first = 0;
  std::size_t last = 0;
};

double step_m(const PartGraph& graph, std::size_t part) {
  return (graph.parts[part + 1].map_T_part.translation() -
          graph.parts[part].map_T_part.translation())
      .norm();
}

/// The parts up to `reach_m` of path around the part, within `within`.
Window window_around(const PartGraph& graph, std::size_t part, double reach_m, Window within) {
  Window window{part, part};
  for (double path_m = 0.0; window.first > within.first; --window.first) {
    path_m += step_m(graph, window.first - 1);
    if (path_m > reach_m) break;
  }
  for (double path_m = 0.0; window.last < within.last; ++window.last) {
    path_m += step_m(graph, window.last);
    if (path_m > reach_m) break;
  }
  return window;
}

/// Landmarks of the window in the frame of the part.
std::vector<model::MapLandmark> landmarks_in(const map_file::StoredMap& map, const PartGraph& graph,
                                             std::size_t part, Window window) {
  const geometry::SE2 part_T_map = graph.parts[part].map_T_part.inverse();
  const Eigen::Matrix2d turn = part_T_map.rotation();
  std::vector<model::MapLandmark> landmarks;
  for (std::size_t i = window.first; i <= window.last; ++i) {
    for (const std::uint32_t index : graph.parts[i].landmarks) {
      model::MapLandmark& one = landmarks.emplace_back(map.landmarks[index].landmark);
      one.position_m = part_T_map * one.position_m;
      one.covariance_m2 = turn * one.covariance_m2 * turn.transpose();
      // This covariance is relative to the whole map and includes drift; the one relative to the
      // part is unknown.
      if (graph.parts[i].is_held) one.covariance_m2.setZero();
    }
  }
  return landmarks;
}

}  // namespace

FoundClosure find_closure(const map_file::StoredMap& map, const PartGraph& graph, std::size_t from,
                          std::size_t to, const map_merge::AlignmentParameters& parameters,
                          const std::function<void(double)>& progress) {
  const std::size_t early = std::min(from, to);
  const std::size_t late = std::max(from, to);
  if (late - early <= 2 * kBetween)
    throw ClosureError("the two are neighbours on the path: there is no loop between them");
  const std::size_t half = (early + late) / 2;

  map_merge::AlignmentParameters stricter = parameters;
  stricter.max_log10_false_alarm -= std::log10(static_cast<double>(kReaches_m.size()));
  FoundClosure found;
  for (std::size_t i = 0; i < kReaches_m.size() && !found.alignment.found(); ++i) {
    found.reach_m = kReaches_m[i];
    const Window before =
        window_around(graph, early, kReaches_m[i], {0, std::max(early, half - kBetween)});
    const Window after = window_around(graph, late, kReaches_m[i],
                                       {std::min(late, half + kBetween), graph.parts.size() - 1});
    const auto progress_of_all = [&](double part) {
      progress((static_cast<double>(i) + part) / static_cast<double>(kReaches_m.size()));
    };
    found.alignment = map_merge::align(
        landmarks_in(map, graph, from, from == early ? before : after),
        landmarks_in(map, graph, to, to == early ? before : after), stricter, progress_of_all);
  }

  const Eigen::Vector3d place(kPlaceSigma_m, kPlaceSigma_m, kPlaceSigma_rad);
  const Eigen::Matrix3d own = place.array().square().matrix().asDiagonal();
  found.from_T_to = {found.alignment.first_T_second, found.alignment.covariance + own};
  return found;
}

}  // namespace understory::map_closure
