#include "eval/experiments/merges/pairs.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/slam_session.hpp"
#include "eval/tools/thread_clock.hpp"
#include "sim/drive.hpp"

namespace understory::eval::experiments::merges {
namespace {

/// A merged landmark farther from where it belongs is wrong.
constexpr double kWrongMerge_m = 1.0;
/// A landmark is the tree that stands so near to it.
constexpr double kOfTree_m = 0.5;

geometry::SE2 random_motion(std::mt19937_64& random) {
  std::uniform_real_distribution<double> side(-200.0, 200.0);
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  const double x = side(random);
  const double y = side(random);
  return {x, y, angle(random)};
}

struct Rectangle {
  Eigen::Vector2d low_m;
  Eigen::Vector2d high_m;
  bool contains(const Eigen::Vector2d& point) const {
    return (point.array() >= low_m.array()).all() && (point.array() < high_m.array()).all();
  }
};

Rectangle bounds_of(const std::vector<Eigen::Vector2d>& trees) {
  Rectangle bounds{trees.front(), trees.front()};
  for (const Eigen::Vector2d& tree : trees) {
    bounds.low_m = bounds.low_m.cwiseMin(tree);
    bounds.high_m = bounds.high_m.cwiseMax(tree);
  }
  return bounds;
}

KnownMap observed(const std::vector<Eigen::Vector2d>& trees, const std::vector<bool>& stands,
                  const Rectangle& part, std::uint32_t map_id, const geometry::SE2& map_T_world,
                  const CutSetting& setting, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, setting.sigma_m);
  KnownMap known;
  known.map.map_id = map_id;
  for (std::size_t i = 0; i < trees.size(); ++i) {
    if (!stands[i] || !part.contains(trees[i]) || unit(random) >= setting.common) continue;
    map_file::StoredLandmark one;
    one.landmark.id = map_file::landmark_id(map_id, known.trees.size() + 1);
    const double x = noise(random);
    one.landmark.position_m = map_T_world * trees[i] + Eigen::Vector2d(x, noise(random));
    one.landmark.covariance_m2 = setting.sigma_m * setting.sigma_m * Eigen::Matrix2d::Identity();
    known.map.landmarks.push_back(one);
    known.trees.push_back(i);
  }
  return known;
}

/// Which trees a drive's landmarks are, by the truth at its first keyframe.
std::vector<std::size_t> trees_of(const map_file::StoredMap& map, const sim::Forest& forest,
                                  const geometry::SE2& map_T_world) {
  std::vector<std::size_t> trees;
  for (const map_file::StoredLandmark& one : map.landmarks) {
    const Eigen::Vector2d at = map_T_world.inverse() * one.landmark.position_m;
    std::size_t nearest = kNoTree;
    double least_m = kOfTree_m;
    for (std::size_t i = 0; i < forest.trunks_m.size(); ++i) {
      const double distance_m = (forest.trunks_m[i] - at).norm();
      if (distance_m >= least_m) continue;
      least_m = distance_m;
      nearest = i;
    }
    trees.push_back(nearest);
  }
  return trees;
}

/// A drive's map, and its frame.
struct DrivenMap {
  KnownMap known;
  geometry::SE2 map_T_world;
};

DrivenMap drive_once(const sim::Forest& forest, const DriveSetting& setting, std::uint32_t map_id,
                     std::uint64_t seed, const std::atomic<bool>& stop) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  sim::Forest there = forest;
  there.trunks_m.clear();
  there.radii_m.clear();
  for (const Eigen::Vector2d& trunk : forest.trunks_m) {
    if (unit(random) >= setting.seen) continue;
    there.trunks_m.push_back(trunk);
    there.radii_m.push_back(0.0);
  }

  sim::DriveParameters parameters;
  parameters.path.length_m = setting.length_m;
  parameters.sensor.position_sigma_m = setting.sigma_m;
  const sim::Drive drive(parameters, std::move(there), seed);
  harness::SlamSession session(harness::make_stages("smoothing"));
  std::map<model::Utime, geometry::SE2> truth;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (stop) throw terminal::Interrupted();
    const sim::SimulatedScan scan = drive.scan(k);
    truth[scan.scan.utime] = scan.world_T_vehicle;
    (void)session.feed(scan.scan);
  }

  DrivenMap driven;
  map_file::StoredMap& map = driven.known.map;
  map.map_id = map_id;
  map.keyframes = session.mapper().trajectory();
  if (map.keyframes.empty()) throw std::runtime_error("map-merge: a drive made no map");
  for (model::MapLandmark landmark : session.mapper().landmarks()) {
    const std::uint64_t counter = map.landmarks.size() + 1;
    landmark.id = map_file::landmark_id(map_id, counter);
    map.landmarks.push_back({landmark, std::nullopt, std::nullopt});
  }
  const model::KeyframePose& base = map.keyframes.front();
  driven.map_T_world = base.map_T_vehicle * truth.at(base.utime).inverse();
  driven.known.trees = trees_of(map, forest, driven.map_T_world);
  return driven;
}

/// Landmarks and the trees that they are: which ones hang together.
class Counting {
 public:
  void add(model::LandmarkId landmark, std::size_t tree) {
    if (tree == kNoTree) return;
    const Node a{true, landmark};
    const Node b{false, tree};
    parents_.try_emplace(a, a);
    parents_.try_emplace(b, b);
    parents_[root_of(a)] = root_of(b);
  }
  /// Landmarks beyond the number of trees that they are. Neighbours whose pairs were exchanged
  /// count as none: there is a landmark for each.
  std::size_t doubled() const {
    std::map<Node, int> excess;
    for (const auto& [node, parent] : parents_) excess[root_of(node)] += node.first ? 1 : -1;
    std::size_t count = 0;
    for (const auto& [root, more] : excess) count += static_cast<std::size_t>(std::max(0, more));
    return count;
  }

 private:
  using Node = std::pair<bool, std::uint64_t>;  // is a landmark, its id; or a tree
  Node root_of(Node node) const {
    while (parents_.at(node) != node) node = parents_.at(node);
    return node;
  }
  std::map<Node, Node> parents_;
};

std::size_t doubled_in(const KnownMap& known) {
  Counting counting;
  for (std::size_t i = 0; i < known.trees.size(); ++i)
    counting.add(known.map.landmarks[i].landmark.id, known.trees[i]);
  return counting.doubled();
}

std::size_t doubled_in(const MapPair& pair, const map_merge::MergedMaps& merged) {
  Counting counting;
  for (std::size_t i = 0; i < pair.first.trees.size(); ++i)
    counting.add(pair.first.map.landmarks[i].landmark.id, pair.first.trees[i]);
  const std::map<model::LandmarkId, model::LandmarkId> renamed(merged.renamed.begin(),
                                                               merged.renamed.end());
  for (std::size_t i = 0; i < pair.second.trees.size(); ++i)
    counting.add(renamed.at(pair.second.map.landmarks[i].landmark.id), pair.second.trees[i]);
  return counting.doubled();
}

/// Error and stated deviation of the motion in the middle of the pairs.
void score_motion(const MapPair& pair, const map_merge::Alignment& found, MergeTrial& trial) {
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();
  for (const map_merge::LandmarkPair& one : found.pairs)
    middle_m += pair.second.map.landmarks[one.second].landmark.position_m;
  middle_m /= static_cast<double>(found.pairs.size());
  trial.offset_m = (found.first_T_second * middle_m - pair.first_T_second * middle_m).norm();

  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << Eigen::Matrix2d::Identity(), geometry::perpendicular(middle_m);
  const Eigen::Matrix2d there = jacobian * found.covariance * jacobian.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(there, Eigen::EigenvaluesOnly);
  trial.sigma_m = std::sqrt(std::max(0.0, solver.eigenvalues().maxCoeff()));
  const Eigen::Vector3d error = (found.first_T_second.inverse() * pair.first_T_second).Log();
  trial.nees = error.dot(found.covariance.ldlt().solve(error));
}

}  // namespace

Visits unchanged(std::vector<Eigen::Vector2d> trees_m) {
  const std::vector<bool> all(trees_m.size(), true);
  return {std::move(trees_m), all, all};
}

Visits visits_of(const std::vector<Eigen::Vector2d>& first_m,
                 const std::vector<Eigen::Vector2d>& second_m) {
  std::map<std::pair<double, double>, std::pair<bool, bool>> stands;
  for (const Eigen::Vector2d& tree : first_m) stands[{tree.x(), tree.y()}].first = true;
  for (const Eigen::Vector2d& tree : second_m) stands[{tree.x(), tree.y()}].second = true;
  Visits visits;
  for (const auto& [place, when] : stands) {
    visits.trees_m.emplace_back(place.first, place.second);
    visits.at_first.push_back(when.first);
    visits.at_second.push_back(when.second);
  }
  return visits;
}

MapPair cut_maps(const Visits& visits, const CutSetting& setting, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Rectangle bounds = bounds_of(visits.trees_m);
  const Eigen::Vector2d extent = bounds.high_m - bounds.low_m;
  const double width_m = std::min(setting.width_m, extent.x() / (2.0 - setting.overlap));
  const double height_m = std::min(setting.width_m, extent.y());
  const double step_m = (1.0 - setting.overlap) * width_m;
  const double x = bounds.low_m.x() + unit(random) * (extent.x() - width_m - step_m);
  const double y = bounds.low_m.y() + unit(random) * (extent.y() - height_m);

  const Rectangle first{{x, y}, {x + width_m, y + height_m}};
  const Eigen::Vector2d step(step_m, 0.0);
  const Rectangle second{first.low_m + step, first.high_m + step};
  const geometry::SE2 first_T_world = random_motion(random);
  const geometry::SE2 second_T_world = random_motion(random);
  MapPair pair;
  pair.first = observed(visits.trees_m, visits.at_first, first, 1, first_T_world, setting, random);
  pair.second =
      observed(visits.trees_m, visits.at_second, second, 2, second_T_world, setting, random);
  pair.first_T_second = first_T_world * second_T_world.inverse();
  pair.overlaps = setting.overlap > 0.0;
  return pair;
}

MapPair drive_maps(const DriveSetting& setting, std::uint64_t seed, const std::atomic<bool>& stop) {
  std::mt19937_64 random(seed);
  sim::ForestParameters parameters = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.side_m = setting.side_m;
  const sim::Forest forest = sim::make_forest(parameters, random);
  const std::uint64_t first_seed = random();
  const std::uint64_t second_seed = random();
  DrivenMap first = drive_once(forest, setting, 1, first_seed, stop);
  DrivenMap second = drive_once(forest, setting, 2, second_seed, stop);

  MapPair pair;
  pair.first = std::move(first.known);
  pair.second = std::move(second.known);
  pair.first_T_second = first.map_T_world * second.map_T_world.inverse();
  return pair;
}

MergeTrial merge_trial(const MapPair& pair) {
  MergeTrial trial;
  trial.overlaps = pair.overlaps;
  const auto first = map_merge::landmarks_of(pair.first.map);
  const auto second = map_merge::landmarks_of(pair.second.map);
  const double begin_s = tools::thread_time_s();
  const map_merge::Alignment found = map_merge::align(first, second);
  trial.ms = 1e3 * (tools::thread_time_s() - begin_s);
  trial.log10_false_alarm = found.log10_false_alarm;
  trial.share = found.share();
  trial.merged = found.found();
  if (!trial.merged) return trial;

  score_motion(pair, found, trial);
  trial.wrong = !pair.overlaps || trial.offset_m > kWrongMerge_m;
  const map_merge::MergedMaps merged = map_merge::fuse(pair.first.map, pair.second.map, found);
  trial.landmarks = merged.map.landmarks.size();
  trial.doubled = doubled_in(pair, merged);
  trial.doubled_before = doubled_in(pair.first) + doubled_in(pair.second);
  return trial;
}

}  // namespace understory::eval::experiments::merges
