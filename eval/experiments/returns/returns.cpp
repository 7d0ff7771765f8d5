#include "eval/experiments/returns/returns.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "eval/harness/block.hpp"
#include "eval/tools/quantile.hpp"
#include "eval/tools/thread_clock.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "sim/point_grid.hpp"

namespace understory::eval::experiments::returns {
namespace {

constexpr double kStep_m = 2.0;               // between keyframes
constexpr model::Utime kStep_us = 1'000'000;  // at 2 m/s
constexpr double kScansPerKeyframe = 8.0;
constexpr double kMargin_m = 12.0;  // from the edge of the forest
constexpr double kCorner_m = 15.0;  // radius
constexpr double kBeside_m = 2.0;   // a lap runs so far inside the one before
constexpr double kDetection = 0.9;
constexpr double kTranslation = 0.01;  // 1 sigma of odometry, of a step's length
constexpr double kKnownAgain_m = 1.0;
constexpr double kNearStart_m = 60.0;

/// Stems nearer to an earlier one are of the same tree for a sensor [m].
constexpr double kOneTree_m = 0.3;

sim::Forest without_touching(sim::Forest forest) {
  std::vector<Eigen::Vector2d> kept;
  for (const Eigen::Vector2d& trunk : forest.trunks_m) {
    const bool touches = std::any_of(kept.begin(), kept.end(), [&](const Eigen::Vector2d& other) {
      return (other - trunk).norm() < kOneTree_m;
    });
    if (!touches) kept.push_back(trunk);
  }
  forest.trunks_m = std::move(kept);
  forest.radii_m.assign(forest.trunks_m.size(), 0.0);
  return forest;
}

/// The closed way round the forest: a rectangle with round corners.
class Way {
 public:
  Way(const sim::Forest& forest, double inside_m)
      : low_(forest.low_m.array() + kMargin_m + inside_m),
        size_(forest.high_m - forest.low_m -
              2.0 * Eigen::Vector2d::Constant(kMargin_m + inside_m)) {
    if (size_.minCoeff() < 4.0 * kCorner_m)
      throw std::runtime_error("the stem map is too small for a way round it");
    straight_ = size_ - 2.0 * Eigen::Vector2d::Constant(kCorner_m);
  }

  double length_m() const { return harness::block_length_m(straight_, kCorner_m); }

  /// From the middle of the lower side, to the left.
  geometry::SE2 at(double along_m) const {
    const geometry::SE2 start(low_.x() + kCorner_m, low_.y(), 0.0);
    return start * harness::on_block(along_m, straight_, kCorner_m);
  }

 private:
  Eigen::Vector2d low_, size_, straight_;
};

std::vector<geometry::SE2> poses_of(const sim::Forest& forest, int laps) {
  std::vector<geometry::SE2> poses;
  for (int lap = 0; lap < laps; ++lap) {
    const Way way(forest, kBeside_m * lap);
    for (double along = 0.0; along < way.length_m(); along += kStep_m)
      poses.push_back(way.at(along));
  }
  return poses;
}

/// Whether a trunk is seen on a lap: the same all along it.
bool is_seen(std::uint64_t seed, std::size_t trunk, int lap, double share) {
  std::mt19937_64 random(seed * 0x9E3779B97F4A7C15ULL + 1'000'003ULL * trunk +
                         static_cast<std::uint64_t>(lap));
  random.discard(2);
  return std::uniform_real_distribution<double>(0.0, 1.0)(random) < share;
}

/// Which trunk each landmark of the map is, by what was told.
class Identities {
 public:
  /// `trunks`: of the keyframe's landmarks.
  void follow(const model::MapUpdate& update, const std::vector<std::size_t>& trunks,
              ReturnScore& score) {
    for (const model::Association& pair : update.associations) {
      const std::size_t trunk = trunks[pair.keyframe_landmark];
      auto& votes = votes_[pair.landmark_id];
      ++score.associations;
      if (!votes.empty() && trunk_of(pair.landmark_id) != trunk) ++score.false_associations;
      ++votes[trunk];
    }
    for (const auto& [old_id, new_id] : update.merged) {
      ++score.merges;
      if (!votes_.contains(old_id) || !votes_.contains(new_id)) continue;  // Just separated.
      if (trunk_of(old_id) != trunk_of(new_id)) ++score.false_merges;
      const auto votes = std::move(votes_.at(old_id));
      votes_.erase(old_id);
      for (const auto& [trunk, count] : votes) votes_[new_id][trunk] += count;
    }
    remember();
  }

  /// Ids that nothing was associated with are landmarks that were separated.
  static int count_separated(const model::MapUpdate& update) {
    return static_cast<int>(
        std::count_if(update.added.begin(), update.added.end(), [&](model::LandmarkId id) {
          return std::none_of(update.associations.begin(), update.associations.end(),
                              [&](const auto& pair) { return pair.landmark_id == id; });
        }));
  }

  std::size_t trunk_of(model::LandmarkId id) const {
    const auto& votes = votes_.at(id);
    return std::max_element(votes.begin(), votes.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }

  void sum_up(ReturnScore& score) const {
    const auto now = landmarks_of_trunk();
    score.trunks = static_cast<int>(now.size());
    score.doubled = static_cast<int>(doubled_.size());
    for (const std::size_t trunk : doubled_)
      score.joined += now.contains(trunk) && now.at(trunk) == 1;
  }

 private:
  std::map<std::size_t, int> landmarks_of_trunk() const {
    std::map<std::size_t, int> result;
    for (const auto& [id, votes] : votes_) ++result[trunk_of(id)];
    return result;
  }

  void remember() {
    for (const auto& [trunk, count] : landmarks_of_trunk())
      if (count > 1) doubled_.insert(trunk);
  }

  std::map<model::LandmarkId, std::map<std::size_t, int>> votes_;
  std::set<std::size_t> doubled_;
};

class Simulation {
 public:
  Simulation(const ReturnDrive& drive, const sim::Forest& forest, std::uint64_t seed)
      : drive_(drive),
        forest_(forest),
        seed_(seed),
        random_(seed),
        poses_(poses_of(forest, drive.laps)),
        lap_poses_(poses_of(forest, 1).size()) {
    // Heading drifts on the blind stretch; what follows is the lever.
    const double blind_steps = drive.blind_share * static_cast<double>(lap_poses_);
    blind_begin_ = static_cast<std::size_t>(0.3 * static_cast<double>(lap_poses_));
    blind_end_ = blind_begin_ + static_cast<std::size_t>(blind_steps);
    const double lever_m = (poses_[blind_end_].translation() - poses_.front().translation()).norm();
    heading_sigma_ = drive.drift_m / lever_m / std::sqrt(blind_steps);
  }

  std::size_t size() const { return poses_.size(); }
  std::size_t lap_size() const { return lap_poses_; }
  const geometry::SE2& pose(std::size_t k) const { return poses_[k]; }

  model::Odometry odometry(std::size_t k) {
    const double translation = kTranslation * kStep_m;
    const Eigen::Vector3d sigma(translation, 0.2 * translation, heading_sigma_);
    model::Odometry out;
    out.from_utime = static_cast<model::Utime>(k) * kStep_us;
    out.utime = out.from_utime + kStep_us;
    out.sequence = k;
    const Eigen::Vector3d noise = sigma.cwiseProduct(Eigen::Vector3d(unit(), unit(), unit()));
    out.from_T_to = poses_[k - 1].inverse() * poses_[k] * geometry::SE2::Exp(noise);
    out.covariance = sigma.array().square().matrix().asDiagonal();
    out.has_wheels = true;
    return out;
  }

  /// The keyframe of a pose, and the trunk of each landmark; none where nothing is seen.
  std::optional<model::Keyframe> keyframe(std::size_t k, std::vector<std::size_t>& trunks) {
    trunks.clear();
    if (k >= blind_begin_ && k < blind_end_) return std::nullopt;
    const double sigma = drive_.sigma_m / std::sqrt(kScansPerKeyframe);

    model::Keyframe out;
    out.utime = static_cast<model::Utime>(k + 1) * kStep_us;
    out.sequence = ++sequence_;
    out.field_of_view.max_range_m = drive_.range_m;
    out.members.push_back({out.utime, out.sequence, {}, Eigen::Matrix3d::Zero()});
    for (std::size_t trunk = 0; trunk < forest_.trunks_m.size(); ++trunk) {
      const Eigen::Vector2d seen = poses_[k].inverse() * forest_.trunks_m[trunk];
      if (seen.norm() > drive_.range_m ||
          !is_seen(seed_, trunk, lap_of(k, trunk), drive_.seen_share))
        continue;
      if (std::uniform_real_distribution<double>(0.0, 1.0)(random_) > kDetection) continue;
      model::KeyframeLandmark landmark;
      landmark.position_m = seen + sigma * Eigen::Vector2d(unit(), unit());
      landmark.covariance_m2 = sigma * sigma * Eigen::Matrix2d::Identity();
      landmark.observation_count = static_cast<std::uint16_t>(kScansPerKeyframe);
      out.landmarks.push_back(landmark);
      trunks.push_back(trunk);
    }
    return out.landmarks.size() < 3 ? std::nullopt : std::optional(out);
  }

 private:
  double unit() { return normal_(random_); }

  /// Laps are counted where the trunk is out of view.
  int lap_of(std::size_t k, std::size_t trunk) const {
    const Eigen::Vector2d from_start_m = forest_.trunks_m[trunk] - poses_.front().translation();
    const bool is_near_start = from_start_m.norm() < kNearStart_m;
    return static_cast<int>((is_near_start ? k + lap_poses_ / 2 : k) / lap_poses_);
  }

  ReturnDrive drive_;
  const sim::Forest& forest_;
  std::uint64_t seed_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  std::vector<geometry::SE2> poses_;
  std::size_t lap_poses_;
  std::size_t blind_begin_ = 0;
  std::size_t blind_end_ = 0;
  double heading_sigma_ = 0.0;
  std::uint64_t sequence_ = 0;
};

geoslam_mapper::SmoothingMapperParameters mapper_parameters() {
  geoslam_mapper::SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  parameters.gyro_walk = 0.0;
  return parameters;
}

void score_trajectory(const geoslam_mapper::smoothing::SmoothingMapper& mapper,
                      const Simulation& simulation, const geometry::SE2& map_T_world,
                      ReturnScore& score) {
  double squared = 0.0;
  const auto trajectory = mapper.trajectory();
  for (const model::KeyframePose& pose : trajectory) {
    const auto k = static_cast<std::size_t>(pose.utime / kStep_us) - 1;
    score.last_error_m =
        (pose.map_T_vehicle.translation() - (map_T_world * simulation.pose(k)).translation())
            .norm();
    squared += score.last_error_m * score.last_error_m;
  }
  if (!trajectory.empty())
    score.ate_m = std::sqrt(squared / static_cast<double>(trajectory.size()));
}

}  // namespace

ReturnScore drive(const ReturnDrive& drive, const sim::Forest& surveyed, std::uint64_t seed) {
  const sim::Forest forest = without_touching(surveyed);
  Simulation simulation(drive, forest, seed);
  geoslam_mapper::smoothing::SmoothingMapper mapper(mapper_parameters());
  Identities identities;
  ReturnScore score;
  std::vector<double> ms;
  std::vector<std::size_t> trunks;
  double nees = 0.0;
  int poses = 0;
  // Of each map as it stood when it began: who was lost may begin another one.
  std::map<std::uint32_t, geometry::SE2> map_T_world;
  std::uint32_t map_id = 0;

  for (std::size_t k = 0; k < simulation.size(); ++k) {
    if (k > 0) mapper.add(simulation.odometry(k));
    const auto keyframe = simulation.keyframe(k, trunks);
    if (!keyframe) continue;

    const double begin = tools::thread_time_s();
    const model::MapUpdate update = mapper.add(*keyframe);
    ms.push_back(1e3 * (tools::thread_time_s() - begin));
    ++score.keyframes;
    using enum model::MapUpdateStatus;
    if (update.status != kUpdated && update.status != kFirstMap) {
      ++score.refused;
      continue;
    }

    map_id = update.map_id;
    map_T_world.try_emplace(map_id, update.map_T_vehicle * simulation.pose(k).inverse());
    identities.follow(update, trunks, score);
    score.revoked += Identities::count_separated(update);
    const geometry::SE2 truth = map_T_world.at(map_id) * simulation.pose(k);
    const Eigen::Vector3d error = (update.map_T_vehicle.inverse() * truth).Log();
    if (k < simulation.lap_size()) {
      score.drift_m = error.head<2>().norm();
    } else if (score.first_closure_m < 0.0 && error.head<2>().norm() < kKnownAgain_m) {
      score.first_closure_m = kStep_m * static_cast<double>(k - simulation.lap_size());
    }
    if (k + simulation.lap_size() < simulation.size() || update.status == kFirstMap) continue;
    const double one = error.dot(update.covariance.inverse() * error);
    nees += one;
    score.largest_nees = std::max(score.largest_nees, one);
    ++poses;
  }

  identities.sum_up(score);
  score_trajectory(mapper, simulation, map_T_world[map_id], score);
  if (poses > 0) score.mean_nees = nees / poses;
  score.p99_ms = tools::quantile(ms, 0.99);
  score.largest_ms = tools::quantile(ms, 1.0);
  return score;
}

}  // namespace understory::eval::experiments::returns
