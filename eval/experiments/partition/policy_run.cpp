#include "eval/experiments/partition/policy_run.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <optional>
#include <stdexcept>

#include "common/bus/parameter_table.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/tools/memory.hpp"
#include "eval/tools/quantile.hpp"
#include "eval/tools/thread_clock.hpp"
#include "services/geoslam_mapper/adapter_parameters.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::eval::experiments::partition {
namespace {

namespace smoothing = geoslam_mapper::smoothing;

constexpr state::Format kStretchFormat{"partition.stretch", 1};

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

/// Feeds a mapper and keeps what it gives away.
class PolicyDrive {
 public:
  PolicyDrive(const RecordedDrive& drive,
              const geoslam_mapper::SmoothingMapperParameters& parameters)
      : drive_(drive), parameters_(parameters), mapper_(parameters) {
    mapper_.keep_stretches();
  }

  PolicyRun run() {
    for (const MapperInput& input : drive_.inputs) {
      terminal::throw_if_interrupted();
      if (const auto* keyframe = std::get_if<model::Keyframe>(&input)) {
        add(*keyframe);
      } else {
        std::visit([this](const auto& one) { feed(one); }, input);
      }
    }
    result_.resident_mb = tools::resident_mb();
    result_.condensed = mapper_.current().map().all_poses();
    result_.iteration_ms = mean_of(other_ms_);
    result_.partition_ms = cut_ms_.empty() ? 0.0 : mean_of(cut_ms_) - mean_of(other_ms_);
    other_ms_.insert(other_ms_.end(), cut_ms_.begin(), cut_ms_.end());
    result_.iteration_ms_p99 = tools::quantile(other_ms_, 0.99);
    if (told_ > 0) result_.mean_nees /= static_cast<double>(told_);
    settle_all();
    return std::move(result_);
  }

 private:
  void feed(const model::Odometry& one) { mapper_.add(one); }
  void feed(const model::RestLevel& one) { mapper_.add(one); }
  void feed(const model::EkfPose& one) { mapper_.add(one); }
  void feed(const model::EkfLevel& one) { mapper_.add(one); }
  void feed(const model::Keyframe& /*one*/) {}

  void add(const model::Keyframe& keyframe) {
    const double begin_s = tools::thread_time_s();
    const model::MapUpdate update = mapper_.add(keyframe);
    const double took_ms = 1e3 * (tools::thread_time_s() - begin_s);
    (void)mapper_.take_changed_landmarks();
    // Another map than before: what was kept is of the one that was left.
    if (update.status == model::MapUpdateStatus::kFirstMap) stretches_.clear();
    std::vector<smoothing::Stretch> stretches = mapper_.take_stretches();
    (stretches.empty() ? other_ms_ : cut_ms_).push_back(took_ms);
    for (smoothing::Stretch& one : stretches) {
      result_.stored_bytes += state::save(kStretchFormat, one).size();
      stretches_.push_back(std::move(one));
    }
    aliases_.add(update.merged);
    if (!update.merged.empty()) result_.joining_s = std::max(result_.joining_s, 1e-3 * took_ms);
    score(update);
  }

  void score(const model::MapUpdate& update) {
    if (update.status == model::MapUpdateStatus::kFirstMap) {
      map_T_world_ = truth_of(update.utime).inverse();
    } else if (update.status == model::MapUpdateStatus::kUpdated) {
      const geometry::SE2 truth = map_T_world_ * truth_of(update.utime);
      const Eigen::Vector3d error = (update.map_T_vehicle.inverse() * truth).Log();
      result_.mean_nees += error.dot(update.covariance.inverse() * error);
      ++told_;
    } else {
      ++result_.refused;
    }
  }

  geometry::SE2 truth_of(model::Utime utime) const {
    return metrics::pose_at(drive_.truth, utime).value_or(geometry::SE2());
  }

  void settle_all() {
    const double begin_s = tools::thread_time_s();
    stretches_.push_back(mapper_.current().rest());
    std::vector<smoothing::PlacedStretch> placed;
    placed.reserve(stretches_.size());
    for (const smoothing::Stretch& one : stretches_) {
      placed.push_back(
          {&one, one.node ? mapper_.current().map().graph.pose(*one.node) : geometry::SE2()});
    }
    result_.graph = smoothing::expand(placed, aliases_, parameters_);
    if (!smoothing::settle(result_.graph, parameters_))
      throw std::runtime_error("the drive put together again is not determined");
    result_.settling_s = tools::thread_time_s() - begin_s;
    result_.settled = result_.graph.trajectory();
    find_cuts();
  }

  /// The pose that holds the map is of the last stretch.
  void find_cuts() {
    std::size_t latest = 0;
    for (const auto& keyframe : result_.graph.keyframes) {
      if (keyframe.pose == result_.graph.keyframes.front().pose) continue;
      const std::size_t owner = result_.graph.stretch_of_pose[index(keyframe.pose)];
      if (owner > latest) result_.cuts.push_back(keyframe.utime);
      latest = std::max(latest, owner);
    }
  }

  const RecordedDrive& drive_;
  const geoslam_mapper::SmoothingMapperParameters& parameters_;
  smoothing::SmoothingMapper mapper_;
  smoothing::LandmarkAliases aliases_;
  std::vector<smoothing::Stretch> stretches_;
  std::vector<double> cut_ms_;
  std::vector<double> other_ms_;
  geometry::SE2 map_T_world_;
  std::size_t told_ = 0;
  PolicyRun result_;
};

}  // namespace

geoslam_mapper::SmoothingMapperParameters ideal_parameters() {
  geoslam_mapper::SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  parameters.gyro_walk = 0.0;
  parameters.start_wait_s = 0.0;
  return parameters;
}

geoslam_mapper::SmoothingMapperParameters configured_parameters(const std::filesystem::path& dir) {
  geoslam_mapper::SmoothingMapperParameters parameters;
  geoslam_mapper::MapperInputParameters input;
  geoslam_mapper::MapperOutputParameters output;
  bus::ParameterTable table;
  geoslam_mapper::describe(parameters, table);
  geoslam_mapper::describe(input, table);
  geoslam_mapper::describe(output, table);
  table.load(dir / "geoslam_mapper.toml");
  return parameters;
}

PolicyRun map_drive(const RecordedDrive& drive, const Policy& policy,
                    geoslam_mapper::SmoothingMapperParameters parameters) {
  policy.set(parameters);
  return PolicyDrive(drive, parameters).run();
}

}  // namespace understory::eval::experiments::partition
