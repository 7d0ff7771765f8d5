#include "sim/stem_frames.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "sim/few_landmarks.hpp"
#include "sim/point_grid.hpp"
#include "sim/random_streams.hpp"

namespace understory::sim {
namespace {

constexpr double kBreastHeightM = 1.3;
constexpr double kSensorHeightM = 1.5;
constexpr double kMostSidewaysM = 1.0;
/// Diameters that a survey lacks: median, and sigma of the logarithm.
constexpr double kMedianDiameterM = 0.28;
constexpr double kDiameterLogSigma = 0.4;
/// A stem is detected if this share of its width is visible.
constexpr double kLeastVisibleShare = 0.5;

/// Uniform from 0 to 1, the same for the same arguments.
double drawn(std::uint64_t seed, std::uint64_t what, std::uint64_t index) {
  std::mt19937_64 random = random_stream(seed ^ (what << 32), Stream::kOther, index);
  return uniform(random, 0.0, 1.0);
}

std::vector<double> diameters_of(const Forest& forest, std::uint64_t seed) {
  std::vector<double> diameters(forest.trunks_m.size());
  for (std::size_t i = 0; i < diameters.size(); ++i) {
    std::mt19937_64 random = random_stream(seed, Stream::kForest, i);
    const double drawn_m = kMedianDiameterM * std::exp(std::normal_distribution<double>(
                                                  0.0, kDiameterLogSigma)(random));
    diameters[i] = forest.radii_m[i] > 0.0 ? 2.0 * forest.radii_m[i] : drawn_m;
  }
  return diameters;
}

/// A stem in range, before the detector.
struct InRange {
  std::uint32_t stem = 0;
  Eigen::Vector2d level_m = Eigen::Vector2d::Zero();  ///< Frame `vehicle_level`.
  double range_m = 0.0;
  double bearing_rad = 0.0;
  double half_width_rad = 0.0;
};

/// Angles hidden by nearer trunks.
class Shadows {
 public:
  /// Visible share of the stem's width.
  double visible_share(const InRange& stem) const {
    constexpr int kRays = 8;
    int open = 0;
    for (int i = 0; i < kRays; ++i) {
      const double at = stem.bearing_rad + stem.half_width_rad * ((2 * i + 1.0) / kRays - 1.0);
      open += std::ranges::none_of(shadows_, [at](const InRange& shadow) {
        const double off = std::abs(geometry::wrap_angle(at - shadow.bearing_rad));
        return off < shadow.half_width_rad;
      });
    }
    return static_cast<double>(open) / kRays;
  }
  void add(const InRange& stem) { shadows_.push_back(stem); }

 private:
  std::vector<InRange> shadows_;
};

/// A drive, frame by frame.
class StemDrive {
 public:
  StemDrive(const Forest& forest, const Route& way, const StemDriveParameters& parameters,
            std::uint64_t seed)
      : way_(way),
        parameters_(parameters),
        seed_(seed),
        shared_(parameters.detector.shared, seed, drive_seed()),
        grid_(forest.trunks_m, parameters.detector.range_m),
        diameters_m_(diameters_of(forest, seed)),
        last_seen_s_(diameters_m_.size(), -std::numeric_limits<double>::infinity()),
        visits_(diameters_m_.size(), 0) {
    sideways_m_ = kMostSidewaysM * (2.0 * drawn(seed, 1, parameters.visit) - 1.0);
    shift_m_ = parameters.spacing_m * drawn(seed, 2, parameters.visit);
  }

  std::size_t size() const {
    return static_cast<std::size_t>((way_.length_m() - shift_m_) / parameters_.spacing_m) + 1;
  }

  model::StemFrame frame(std::size_t k) {
    std::mt19937_64 random = random_stream(drive_seed(), Stream::kObservation, k);
    const double along_m = shift_m_ + parameters_.spacing_m * static_cast<double>(k);
    const geometry::SE2 pose = way_.pose(along_m) * geometry::SE2(0.0, sideways_m_, 0.0);

    model::StemFrame frame;
    frame.utime = 1'000'000 + std::llround(1e6 * along_m / parameters_.speed_mps);
    frame.number = static_cast<std::int64_t>(k);
    set_pose(frame, pose, random);
    add_stems(frame, pose, along_m, random);
    add_false_ones(frame, random);
    std::shuffle(frame.stems.begin(), frame.stems.end(), random);
    return frame;
  }

 private:
  std::uint64_t drive_seed() const { return seed_ + 1'000'003 * parameters_.visit; }

  void set_pose(model::StemFrame& frame, const geometry::SE2& pose, std::mt19937_64& random) const {
    std::normal_distribution<double> tilt(0.0, parameters_.detector.tilt_sigma_rad);
    const double pitch = tilt(random);
    const double roll = tilt(random);
    frame.world_T_sensor.linear() = (Eigen::AngleAxisd(pose.theta(), Eigen::Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                                        .toRotationMatrix();
    frame.world_T_sensor.translation()
        << pose.translation() + Eigen::Vector2d::Constant(parameters_.truth_offset_m),
        kSensorHeightM;
  }

  /// By range, nearest first.
  std::vector<InRange> in_range(const geometry::SE2& pose) const {
    std::vector<InRange> found;
    for (const std::uint32_t i : grid_.within(pose.translation(), parameters_.detector.range_m)) {
      InRange one;
      one.stem = i;
      one.level_m = pose.inverse() * grid_.points()[i];
      one.range_m = one.level_m.norm();
      one.bearing_rad = std::atan2(one.level_m.y(), one.level_m.x());
      one.half_width_rad = std::atan2(0.5 * diameters_m_[i], std::max(one.range_m, 0.1));
      if (std::abs(one.bearing_rad) > 0.5 * parameters_.detector.view_rad) continue;
      found.push_back(one);
    }
    std::ranges::sort(found, {}, [](const InRange& one) { return one.range_m; });
    return found;
  }

  /// Whether the present visit of the stem detects it at all.
  bool is_seen(std::uint32_t stem, double now_s) {
    if (now_s - last_seen_s_[stem] > parameters_.visit_gap_s) ++visits_[stem];
    last_seen_s_[stem] = now_s;
    const std::uint64_t visit = (parameters_.visit << 16) + visits_[stem];
    return drawn(seed_, 16 + visit, stem) < parameters_.detector.seen_share;
  }

  /// Position of the stem with the detector's shared errors, without the independent noise.
  Eigen::Vector2d shown_m(const InRange& stem, const geometry::SE2& pose, double along_m) const {
    if (!parameters_.detector.shared.any()) return stem.level_m;
    return stem.level_m + shared_.error_m(stem.stem, stem.level_m, pose, along_m);
  }

  void add_stems(model::StemFrame& frame, const geometry::SE2& pose, double along_m,
                 std::mt19937_64& random) {
    const StemDetectorParameters& detector = parameters_.detector;
    const double now_s = along_m / parameters_.speed_mps;
    Shadows shadows;
    for (const InRange& stem : in_range(pose)) {
      const bool is_visible = shadows.visible_share(stem) >= kLeastVisibleShare;
      shadows.add(stem);
      const bool is_seen_now = is_seen(stem.stem, now_s);
      const double luck = uniform(random, 0.0, 1.0);
      if (!is_visible || !is_seen_now || luck > detector.detection ||
          diameters_m_[stem.stem] < detector.least_diameter_m || shared_.is_missed(stem.stem))
        continue;
      add_stem(frame, shown_m(stem, pose, along_m), diameters_m_[stem.stem], random);
    }
  }

  void add_stem(model::StemFrame& frame, const Eigen::Vector2d& level_m, double diameter_m,
                std::mt19937_64& random) const {
    const StemDetectorParameters& detector = parameters_.detector;
    std::normal_distribution<double> unit(0.0, 1.0);
    const double x = unit(random), y = unit(random);
    const Eigen::Vector3d noisy(level_m.x() + detector.position_sigma_m * x,
                                level_m.y() + detector.position_sigma_m * y,
                                kBreastHeightM - kSensorHeightM);
    const Eigen::Matrix3d sensor_R_level = model::level_R_sensor(frame).transpose();

    model::Stem stem;
    stem.position_m = sensor_R_level * noisy;
    stem.axis = sensor_R_level * Eigen::Vector3d::UnitZ();
    stem.diameter_m =
        std::max(0.02, diameter_m * (1.0 + detector.diameter_sigma_share * unit(random)));
    stem.score = 1.0;
    frame.stems.push_back(stem);
  }

  void add_false_ones(model::StemFrame& frame, std::mt19937_64& random) const {
    const StemDetectorParameters& detector = parameters_.detector;
    if (!(detector.false_per_frame > 0.0)) return;
    const int count = std::poisson_distribution<int>(detector.false_per_frame)(random);
    for (int i = 0; i < count; ++i) {
      const double range = detector.range_m * std::sqrt(uniform(random, 0.0, 1.0));
      const double bearing = uniform(random, -0.5 * detector.view_rad, 0.5 * detector.view_rad);
      const double diameter = uniform(random, 0.1, 0.5);
      add_stem(frame, range * Eigen::Vector2d(std::cos(bearing), std::sin(bearing)), diameter,
               random);
    }
  }

  const Route& way_;
  StemDriveParameters parameters_;
  std::uint64_t seed_;
  SharedErrors shared_;
  PointGrid grid_;
  std::vector<double> diameters_m_;
  std::vector<double> last_seen_s_;  // by stem
  std::vector<std::uint64_t> visits_;
  double sideways_m_ = 0.0;
  double shift_m_ = 0.0;
};

/// The drive's own forest: thinned if few stems are requested.
Forest forest_of(const Forest& forest, const Route& way, const StemDriveParameters& parameters,
                 std::uint64_t seed) {
  if (!(parameters.stems_in_view > 0.0)) return forest;
  std::vector<geometry::SE2> poses;
  for (double along_m = 0.0; along_m <= way.length_m(); along_m += parameters.spacing_m)
    poses.push_back(way.pose(along_m));
  const model::FieldOfView view{parameters.detector.range_m, 0.0, parameters.detector.view_rad};
  return thinned_to(parameters.stems_in_view, forest, poses, view, seed);
}

}  // namespace

std::vector<model::StemFrame> drive_stem_frames(const Forest& forest, const Route& way,
                                                const StemDriveParameters& parameters,
                                                std::uint64_t seed) {
  StemDrive drive(forest_of(forest, way, parameters, seed), way, parameters, seed);
  std::vector<model::StemFrame> frames;
  frames.reserve(drive.size());
  for (std::size_t k = 0; k < drive.size(); ++k) frames.push_back(drive.frame(k));
  return frames;
}

}  // namespace understory::sim
