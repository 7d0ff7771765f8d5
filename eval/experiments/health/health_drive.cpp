#include "eval/experiments/health/health_drive.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "common/geometry/alignment.hpp"
#include "services/associator/adapter.hpp"
#include "services/ekf/adapter.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"

namespace understory::eval::experiments::health {
namespace {

constexpr double kEllipse = 16.27;  ///< chi^2 of 3 degrees of freedom, 99.9 %.
constexpr double kOutside_s = 1.0;
constexpr double kFar_m = 1.0;
constexpr double kFar_s = 2.0;
constexpr double kNoticed_s = 10.0;
constexpr double kScan_s = 0.1;

sim::TrunkField field_of(std::uint64_t seed) {
  sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  forest.side_m = 300.0;
  return sim::make_trunk_field(forest, seed);
}

sim::InertialDriveParameters drive_parameters() {
  sim::InertialDriveParameters parameters;
  parameters.stationary_s = 2.0;
  parameters.speed_mps = 3.0;
  parameters.loop_length_m = 400.0;
  parameters.range_m = 20.0;
  parameters.odometry = sim::OdometryKind::kInertialAndWheels;
  return parameters;
}

/// The pose of one channel against the truth.
class ErrorWatch {
 public:
  void add(const geometry::SE2& estimate, const Eigen::Matrix3d& covariance,
           const geometry::SE2& truth) {
    if (!world_T_map_) world_T_map_ = truth * estimate.inverse();
    const Eigen::Vector3d error = (estimate.inverse() * world_T_map_->inverse() * truth).Log();
    const Eigen::Matrix3d floored = covariance + 1e-8 * Eigen::Matrix3d::Identity();
    const double nees = error.dot(floored.llt().solve(error));
    error_m_ = error.head<2>().norm();
    outside_s_ = nees > kEllipse ? outside_s_ + kScan_s : 0.0;
    far_s_ = error_m_ > kFar_m ? far_s_ + kScan_s : 0.0;
    estimated_m_.push_back(estimate.translation());
    true_m_.push_back(truth.translation());
    sum_nees_ += nees;
  }
  PoseErrors errors() const {
    if (true_m_.empty()) return {};
    const geometry::SE2 world_T_map = geometry::align_rigid(true_m_, estimated_m_);
    PoseErrors errors{.poses = static_cast<int>(true_m_.size())};
    double sum_m2 = 0.0;
    for (std::size_t i = 0; i < true_m_.size(); ++i) {
      const double error_m = (world_T_map * estimated_m_[i] - true_m_[i]).norm();
      if (error_m > kFar_m) ++errors.wrong;
      sum_m2 += error_m * error_m;
    }
    errors.ate_m = std::sqrt(sum_m2 / errors.poses);
    errors.mean_nees = sum_nees_ / errors.poses;
    return errors;
  }
  bool is_noticeable() const { return outside_s_ > kOutside_s || far_s_ > kFar_s; }
  double error_m() const { return error_m_; }

 private:
  std::optional<geometry::SE2> world_T_map_;
  double outside_s_ = 0.0;
  double far_s_ = 0.0;
  double error_m_ = 0.0;
  std::vector<Eigen::Vector2d> estimated_m_;
  std::vector<Eigen::Vector2d> true_m_;
  double sum_nees_ = 0.0;
};

/// When a channel's first error became noticeable, and whether it was noticed.
struct FirstError {
  ErrorWatch watch;
  std::optional<double> since_s;
  bool is_noticed = false;

  void judge(double now_s, bool is_ok) {
    if (!since_s && watch.is_noticeable()) since_s = now_s;
    if (since_s && !is_ok && now_s <= *since_s + kNoticed_s) is_noticed = true;
  }
};

/// The four stages on one bus, by message time.
class Stages {
 public:
  Stages() : bus_(bus::MemoryBus::Queues::kUnlimited) {
    const bus::Clock clock{[this] { return now_us_; }, [this] { return now_us_; }};
    add(keyframer::keyframer_service(), clock, "");
    add(associator::associator_service(), clock, "");
    add(ekf::ekf_service(), clock, "");
    add(geoslam_mapper::geoslam_mapper_service(), clock, "[smoothing]\nuse_odometry = true\n");
    bus_.subscribe("SLAM_POSE", 0, [this](const bus::BusMessage& message) {
      const auto pose = wire::decode_message<model::SlamPose>(message.bytes);
      if (pose && (!pose->status || pose->is_localised())) slam_ = *pose;
    });
    bus_.subscribe("EKF_POSE", 0, [this](const bus::BusMessage& message) {
      if (const auto pose = wire::decode_message<model::EkfPose>(message.bytes)) filter_ = *pose;
    });
  }

  void feed(const sim::DriveStep& step) {
    now_us_ = std::max<std::int64_t>(step.scan.utime, 1);
    for (model::Odometry increment : step.odometry) {
      increment.sequence = odometry_++;
      send("ODOMETRY", wire::encode_message(increment));
    }
    if (step.scan.field_of_view.max_range_m <= 0.0) return;  // It was taken away.
    model::LandmarkScan scan = step.scan;
    scan.sequence = scans_++;
    send("LANDMARKS", wire::encode_message(scan));
  }
  bool are_ok() {
    return std::ranges::all_of(services_, [](const auto& one) {
      return one->node().monitor().state() == health_t::STATE_OK;
    });
  }
  void count_reasons(std::map<std::string, int>& reasons) {
    for (const auto& one : services_) {
      const health_t health = one->node().health();
      for (const reason_count_t& reason : health.reasons) {
        reasons[health.process + " " + reason.reason] += static_cast<int>(reason.count);
      }
    }
  }
  const std::optional<model::SlamPose>& slam() const { return slam_; }
  const std::optional<model::EkfPose>& filter() const { return filter_; }

 private:
  void add(const bus::Service& service, const bus::Clock& clock, const std::string& toml) {
    services_.push_back(
        std::make_unique<bus::HostedService>(service, bus_, clock, toml, "health experiment"));
    services_.back()->node().connect();
  }
  void send(const char* channel, const wire::Bytes& bytes) {
    bus_.publish(channel, bytes);
    bus_.drain();
  }

  std::int64_t now_us_ = 1;
  bus::MemoryBus bus_;
  std::vector<std::unique_ptr<bus::HostedService>> services_;
  std::uint64_t odometry_ = 0;
  std::uint64_t scans_ = 0;
  std::optional<model::SlamPose> slam_;
  std::optional<model::EkfPose> filter_;
};

/// Cuts a part out of the drive: stamps go on without a hole.
void move_back(sim::DriveStep& step, model::Utime by_us) {
  step.scan.utime -= by_us;
  for (model::Odometry& increment : step.odometry) {
    increment.from_utime -= by_us;
    increment.utime -= by_us;
  }
}

void judge(Stages& stages, const sim::DriveStep& step, double now_s, FirstError& slam,
           FirstError& filter, DriveVerdict& verdict) {
  if (stages.slam() && stages.slam()->utime == step.scan.utime) {
    slam.watch.add(stages.slam()->map_T_vehicle(), stages.slam()->covariance, step.world_T_vehicle);
  }
  if (stages.filter() && stages.filter()->utime == step.scan.utime) {
    filter.watch.add(stages.filter()->ekf_map_T_vehicle, stages.filter()->covariance,
                     step.world_T_vehicle);
  }
  const bool is_ok = stages.are_ok();
  slam.judge(now_s, is_ok);
  filter.judge(now_s, is_ok);
  ++verdict.scans;
  if (!is_ok) ++verdict.scans_not_ok;
  verdict.largest_error_m =
      std::max({verdict.largest_error_m, slam.watch.error_m(), filter.watch.error_m()});
}

}  // namespace

Meddle late_by(double seconds) {
  return [seconds](sim::DriveStep& step, std::mt19937_64&) {
    const Eigen::Vector2d velocity_mps =
        step.world_T_vehicle.rotation().transpose() * step.velocity_mps;
    const geometry::SE2 then_T_now = geometry::SE2::Exp(
        seconds * Eigen::Vector3d(velocity_mps.x(), velocity_mps.y(), step.rate_rad_s));
    for (model::Detection& one : step.scan.detections) {
      one.position_m.head<2>() = then_T_now * Eigen::Vector2d(one.position_m.head<2>());
    }
  };
}

std::vector<Fault> faults() {
  const auto for_each = [](const std::function<void(model::Detection&)>& change) {
    return [change](sim::DriveStep& step, std::mt19937_64&) {
      std::ranges::for_each(step.scan.detections, change);
    };
  };
  const Eigen::Rotation2Dd mounted(5.0 * std::numbers::pi / 180.0);
  return {
      {"none", {}},
      {"sigma stated / 4", for_each([](auto& one) { one.covariance_m2 /= 16.0; })},
      {"sigma stated x 4", for_each([](auto& one) { one.covariance_m2 *= 16.0; })},
      {"wheels slip by a third",
       [](sim::DriveStep& step, std::mt19937_64&) {
         for (model::Odometry& increment : step.odometry) {
           increment.from_T_to =
               geometry::SE2(1.3 * increment.from_T_to.translation(), increment.from_T_to.theta());
         }
       }},
      {"landmarks shuffled",
       [](sim::DriveStep& step, std::mt19937_64& random) {
         std::uniform_real_distribution<double> where(-15.0, 15.0);
         for (model::Detection& one : step.scan.detections) {
           one.position_m.head<2>() = Eigen::Vector2d(where(random), where(random));
         }
       }},
      {"no landmarks",
       [](sim::DriveStep& step, std::mt19937_64&) { step.scan.field_of_view.max_range_m = 0.0; }},
      {"no odometry", [](sim::DriveStep& step, std::mt19937_64&) { step.odometry.clear(); }},
      {"mounted 5 degrees off", for_each([mounted](auto& one) {
         one.position_m.template head<2>() = mounted * one.position_m.template head<2>();
       })},
      {"scans stamped 0.2 s late", late_by(0.2)},
      {"scans stamped 50 ms late", late_by(0.05)},
      {"carried away", {}, 30.0},
  };
}

DriveVerdict drive(const Fault& fault, const DrivePlan& plan, std::uint64_t seed) {
  const sim::TrunkField field = field_of(seed);
  sim::InertialDrive drive(drive_parameters(), field, seed);
  std::mt19937_64 random(seed);
  Stages stages;
  FirstError slam;
  FirstError filter;
  DriveVerdict verdict;
  model::Utime cut_us = 0;

  for (double now_s = 0.0; now_s < plan.seconds; now_s += kScan_s) {
    if (fault.skipped_s > 0.0 && cut_us == 0 && now_s >= plan.fault_at_s) {
      for (double t = 0.0; t < fault.skipped_s; t += kScan_s) drive.next();
      cut_us = static_cast<model::Utime>(std::llround(fault.skipped_s / kScan_s)) * 100'000;
    }
    sim::DriveStep step = drive.next();
    move_back(step, cut_us);
    const bool is_faulty = now_s >= plan.fault_at_s && now_s < plan.fault_at_s + plan.fault_lasts_s;
    if (is_faulty && fault.meddle) fault.meddle(step, random);
    stages.feed(step);
    judge(stages, step, now_s, slam, filter, verdict);
  }

  for (const FirstError* one : {&slam, &filter}) {
    if (!one->since_s || *one->since_s + kNoticed_s > plan.seconds) continue;
    ++verdict.errors;
    if (!one->is_noticed) ++verdict.errors_unnoticed;
  }
  verdict.slam = slam.watch.errors();
  verdict.filter = filter.watch.errors();
  stages.count_reasons(verdict.reasons);
  return verdict;
}

}  // namespace understory::eval::experiments::health
