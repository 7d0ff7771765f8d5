// A drive round a ring as the mapper leaves it in a file that knows nothing of its end being its
// beginning; with the truth, and with the batch solution of what was measured.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "common/factor_graph/plane/optimise.hpp"
#include "common/map_closure/finding.hpp"

namespace understory::test {

/// How it is driven.
struct RingMapOptions {
  std::uint64_t seed = 1;
  std::size_t around = 36;  ///< Submaps of one lap.
  std::size_t more = 4;     ///< Of the next one: the last of them is where the `more`-th was.
  double radius_m = 110.0;
  double range_m = 20.0;
  double seen_share = 0.7;
  double sigma_m = 0.05;
  double motion_sigma_m = 0.1;
  double motion_sigma_rad = 0.01;
  std::size_t ground = 0;  ///< So many submaps at the end are ground that the mapper held.
};

/// Submap i + 1 is place i, a submap's length from the one before.
class RingMap {
 public:
  explicit RingMap(const RingMapOptions& options) : options_(options), random_(options.seed) {
    plant();
    drive();
    measure();
    (void)factor_graph::plane::optimise(open_);
    store();
  }

  std::size_t size() const { return truth_.size(); }
  std::size_t stored() const { return size() - options_.ground; }
  const geometry::SE2& truth(std::size_t place) const { return truth_[place]; }
  const geometry::SE2& estimate(std::size_t place) const { return open_.poses[place]; }
  /// The batch solution with a closure.
  std::vector<geometry::SE2> batch(std::size_t from, std::size_t to,
                                   const geometry::SE2WithCovariance& from_T_to) const {
    factor_graph::plane::Graph graph = open_;
    graph.relative_poses.push_back(
        {id(from), id(to), from_T_to.mean, Eigen::Matrix3d(from_T_to.covariance.inverse())});
    (void)factor_graph::plane::optimise(graph);
    return graph.poses;
  }
  /// What somebody measures between two places.
  geometry::SE2WithCovariance measured(std::size_t from, std::size_t to) {
    const Eigen::Vector3d sigma(0.05, 0.05, 0.003);
    return {truth_[from].inverse() * truth_[to] * geometry::SE2::Exp(noise(sigma)),
            sigma.array().square().matrix().asDiagonal()};
  }

  map_file::StoredMap map;
  std::vector<model::Submap> submaps;
  map_closure::Ties ties;
  map_closure::PartGraph graph() const { return map_closure::part_graph(map, submaps, ties, {}); }

 private:
  static factor_graph::plane::PoseId id(std::size_t place) {
    return factor_graph::plane::PoseId(static_cast<std::uint32_t>(place));
  }
  Eigen::Vector3d noise(const Eigen::Vector3d& sigma) {
    const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
    return sigma.cwiseProduct(Eigen::Vector3d(x, y, z));
  }

  void plant() {
    const double side_m = options_.radius_m + options_.range_m;
    std::uniform_real_distribution<double> place(-side_m, side_m);
    const auto count = static_cast<std::size_t>(0.015 * 4.0 * side_m * side_m);
    while (trees_.size() < count) {
      const double x = place(random_);
      trees_.emplace_back(x, place(random_) + options_.radius_m);
    }
  }

  void drive() {
    const double turn = 2.0 * std::numbers::pi / static_cast<double>(options_.around);
    const geometry::SE2 step = geometry::SE2::Exp({options_.radius_m * turn, 0.0, turn});
    for (std::size_t i = 0; i < options_.around + options_.more; ++i)
      truth_.push_back(i == 0 ? geometry::SE2() : truth_.back() * step);
  }

  /// Near the start a tree is another landmark on the second visit.
  model::LandmarkId landmark_of(std::size_t tree, std::size_t place) const {
    const Eigen::Vector2d from_middle = trees_[tree] - Eigen::Vector2d(0.0, options_.radius_m);
    const bool is_second = from_middle.y() < 0.0 && place > options_.around / 2;
    return map_file::landmark_id(1, 2 * tree + (is_second ? 2 : 1));
  }

  void measure() {
    namespace plane = factor_graph::plane;
    geometry::SE2 pose;
    const Eigen::Vector3d sigma(options_.motion_sigma_m, options_.motion_sigma_m,
                                options_.motion_sigma_rad);
    const Eigen::Matrix3d information = sigma.array().square().inverse().matrix().asDiagonal();
    for (std::size_t i = 0; i < size(); ++i) {
      if (i > 0) {
        const geometry::SE2 motion =
            truth_[i - 1].inverse() * truth_[i] * geometry::SE2::Exp(noise(sigma));
        pose = pose * motion;
        open_.relative_poses.push_back({id(i - 1), id(i), motion, information});
      }
      open_.add_pose(pose);
      observe(i);
    }
    open_.pose_priors.push_back({id(0), {}, 1e12 * Eigen::Matrix3d::Identity()});
  }

  void observe(std::size_t place) {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const double information = 1.0 / (options_.sigma_m * options_.sigma_m);
    for (std::size_t tree = 0; tree < trees_.size(); ++tree) {
      const Eigen::Vector2d at = truth_[place].inverse() * trees_[tree];
      if (at.norm() > options_.range_m || unit(random_) >= options_.seen_share) continue;
      const double x = normal_(random_);
      const Eigen::Vector2d seen = at + options_.sigma_m * Eigen::Vector2d(x, normal_(random_));
      const auto [entry, is_new] = point_of_.try_emplace(landmark_of(tree, place));
      if (is_new) {
        entry->second = {open_.add_point(open_.poses[place] * seen), place, 0};
      }
      ++entry->second.views;
      open_.observations.push_back(
          {id(place), entry->second.point, seen, information * Eigen::Matrix2d::Identity()});
    }
  }

  void store() {
    map.map_id = 1;
    for (std::size_t i = 0; i < size(); ++i) store_place(i);
    for (const auto& [landmark, known] : point_of_) store_landmark(landmark, known);
    store_ties();
  }

  void store_place(std::size_t place) {
    model::Submap submap;
    submap.id = place + 1;
    submap.utime = static_cast<model::Utime>(place) * 10'000'000;
    submap.map_T_submap = estimate(place);
    for (int k = -1; k <= 1; ++k) {
      model::KeyframePose pose;
      pose.keyframe_sequence = 3 * place + static_cast<std::uint64_t>(k + 1);
      pose.utime = submap.utime + 2'000'000 * (k + 1);
      pose.map_T_vehicle = geometry::SE2(5.0 * k, 0.0, 0.02 * k);
      pose.covariance = 1e-4 * Eigen::Matrix3d::Identity();
      submap.keyframes.push_back(pose);
      pose.map_T_vehicle = estimate(place) * pose.map_T_vehicle;
      // Of the ground with all that was lost on the way.
      if (place >= stored()) pose.covariance = Eigen::Vector3d(25.0, 25.0, 0.05).asDiagonal();
      map.keyframes.push_back(pose);
    }
    if (place < stored()) submaps.push_back(submap);
  }

  struct Known {
    factor_graph::plane::PointId point{};
    std::size_t home = 0;
    int views = 0;
  };
  void store_landmark(model::LandmarkId landmark, const Known& known) {
    map_file::StoredLandmark one;
    one.landmark.id = landmark;
    one.landmark.position_m = open_[known.point];
    Eigen::Matrix2d shape;
    shape << 1.0, 0.2, 0.2, 0.5;
    one.landmark.covariance_m2 = options_.sigma_m * options_.sigma_m / known.views * shape;
    if (known.home < stored()) {
      one.submap_id = known.home + 1;
      submaps[known.home].landmarks.push_back(one.landmark);
      submaps[known.home].landmarks.back().position_m =
          estimate(known.home).inverse() * one.landmark.position_m;
    } else {
      one.landmark.covariance_m2 += 25.0 * Eigen::Matrix2d::Identity();
    }
    map.landmarks.push_back(one);
  }

  void store_ties() {
    for (std::uint32_t i = 0; i < stored(); ++i) ties.submap_of[i] = i + 1;
    for (const auto& motion : open_.relative_poses) {
      const map_closure::Motion one{index(motion.a), index(motion.b), motion.a_T_b,
                                    motion.information, 0};
      if (std::max(one.from, one.to) > stored()) continue;  // No submap names it.
      ties.motions.push_back(one);
      ties.motions.push_back(one);  // Both ends name it.
    }
    std::map<std::uint32_t, std::vector<map_closure::View>> views;
    for (const auto& seen : open_.observations)
      views[index(seen.point)].push_back({index(seen.pose), seen.position, seen.information});
    for (const auto& [point, of_point] : views) ties.landmarks.push_back(of_point);
  }

  RingMapOptions options_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector2d> trees_;
  std::vector<geometry::SE2> truth_;
  factor_graph::plane::Graph open_;
  std::map<model::LandmarkId, Known> point_of_;
};

/// The worst distance between poses [m].
inline double farthest_m(const std::vector<geometry::SE2>& a, const std::vector<geometry::SE2>& b) {
  double farthest = 0.0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    farthest = std::max(farthest, (a[i].translation() - b[i].translation()).norm());
  return farthest;
}

}  // namespace understory::test
