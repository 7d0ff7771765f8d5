#include "eval/harness/false_detections.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "common/bus/node.hpp"

namespace understory::eval::harness {
namespace {

constexpr double kSigma_m = 0.02;
/// From scan to scan.
constexpr double kPeriod_s = 0.1;

/// Something that stands there for a while.
struct Ghost {
  Eigen::Vector2d world_m = Eigen::Vector2d::Zero();
  double radius_m = 0.2;
  model::Utime until = 0;
};

class FalseDetections : public bus::Adapter {
 public:
  FalseDetections(const FalseDetectionOptions& options,
                  std::function<geometry::SE2(model::Utime)> world_T_vehicle,
                  std::shared_ptr<FalseDetectionCounts> counts, std::string found,
                  std::string landmarks)
      : options_(options),
        world_T_vehicle_(std::move(world_T_vehicle)),
        counts_(std::move(counts)),
        found_(std::move(found)),
        landmarks_(std::move(landmarks)),
        random_(options.seed) {
    if (!counts_) counts_ = std::make_shared<FalseDetectionCounts>();
  }

  void describe(bus::ParameterTable& /*table*/) override {}
  void bind(bus::Node& node) override {
    node.subscribe<model::LandmarkScan>(found_, [this](const model::LandmarkScan& scan) {
      model::LandmarkScan changed = scan;
      add_to(changed);
      publisher_.publish(changed);
    });
    publisher_ = node.advertise<model::LandmarkScan>(landmarks_);
  }
  std::string save() const override { return {}; }
  void load(const std::string& /*state*/) override {}

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  /// Evenly over the disc around the vehicle, but not on top of it.
  Eigen::Vector2d somewhere() {
    const double range_m = std::sqrt(uniform(4.0, options_.within_m * options_.within_m));
    const double bearing = uniform(-std::numbers::pi, std::numbers::pi);
    return range_m * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
  }
  std::uint64_t draw(double mean) {
    return std::poisson_distribution<std::uint64_t>(mean)(random_);
  }

  void add_to(model::LandmarkScan& scan) {
    const double wanted =
        static_cast<double>(scan.detections.size()) * options_.share / (1.0 - options_.share);
    for (std::uint64_t i = draw((1.0 - options_.lasting) * wanted); i > 0; --i) {
      add_detection(somewhere(), uniform(0.08, 0.3), scan);
      ++counts_->clutter;
    }

    // As many things begin as keep the share, by how long they stand.
    const geometry::SE2 world_T_vehicle = world_T_vehicle_(scan.utime);
    const double scans = 0.5 * (options_.least_s + options_.most_s) / kPeriod_s;
    for (std::uint64_t i = draw(options_.lasting * wanted / scans); i > 0; --i) {
      const double stands_s = uniform(options_.least_s, options_.most_s);
      ghosts_.push_back({world_T_vehicle * somewhere(), uniform(0.08, 0.3),
                         scan.utime + static_cast<model::Utime>(1e6 * stands_s)});
      ++counts_->things;
    }
    std::erase_if(ghosts_, [&](const Ghost& ghost) { return ghost.until < scan.utime; });
    for (const Ghost& ghost : ghosts_) {
      add_detection(world_T_vehicle.inverse() * ghost.world_m, ghost.radius_m, scan);
      ++counts_->of_things;
    }
    counts_->detections += scan.detections.size();
  }

  void add_detection(const Eigen::Vector2d& at_m, double radius_m, model::LandmarkScan& scan) {
    std::normal_distribution<double> noise(0.0, kSigma_m);
    model::Detection detection;
    detection.position_m << at_m.x() + noise(random_), at_m.y() + noise(random_), 1.3;
    detection.covariance_m2 = kSigma_m * kSigma_m * Eigen::Matrix3d::Identity();
    detection.radius_m = radius_m;
    scan.detections.push_back(detection);
  }

  FalseDetectionOptions options_;
  std::function<geometry::SE2(model::Utime)> world_T_vehicle_;
  std::shared_ptr<FalseDetectionCounts> counts_;
  std::string found_;
  std::string landmarks_;
  std::mt19937_64 random_;
  std::vector<Ghost> ghosts_;
  bus::Publisher<model::LandmarkScan> publisher_;
};

}  // namespace

bus::Service false_detection_service(const FalseDetectionOptions& options,
                                     std::function<geometry::SE2(model::Utime)> world_T_vehicle,
                                     std::shared_ptr<FalseDetectionCounts> counts,
                                     const std::string& found, const std::string& landmarks) {
  bus::ChannelList channels;
  channels.in(found, "detections of one sweep");
  channels.out(landmarks, "the same with false ones among them");
  return {"false_detections", channels,
          [options, world_T_vehicle = std::move(world_T_vehicle), counts = std::move(counts), found,
           landmarks] {
            return std::make_unique<FalseDetections>(options, world_T_vehicle, counts, found,
                                                     landmarks);
          }};
}

}  // namespace understory::eval::harness
