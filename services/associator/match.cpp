#include "services/associator/match.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/gated_points.hpp"

namespace understory::associator {
namespace {

constexpr double kGateFloor_m = 0.03;
constexpr double kBin_m = 4.0;
/// A track with a larger variance is searched separately.
constexpr double kVague_m2 = 1.0;
/// More than any scan needs; further observations begin tracks.
constexpr std::size_t kMostCandidates = 65536;
constexpr double kNone = std::numeric_limits<double>::infinity();

/// A pair inside the gate.
struct Candidate {
  double cost = 0.0;  ///< Minus twice the log likelihood, up to a constant.
  std::uint32_t observation = 0;
  std::uint32_t track = 0;
};

bool cheaper(const Candidate& a, const Candidate& b) {
  if (a.cost != b.cost) return a.cost < b.cost;
  return a.observation != b.observation ? a.observation < b.observation : a.track < b.track;
}

class Matcher {
 public:
  Matcher(std::span<const Track> tracks, std::span<const Observation> observations,
          const geometry::SE2WithCovariance& pose, const AssociatorParameters& parameters)
      : tracks_(tracks),
        by_observation_(observations.size()),
        by_track_(tracks.size()),
        partner_(observations.size(), kFree),
        owner_(tracks.size(), kFree) {
    collect(observations, pose, parameters.gate_sigmas);
    margin_ = 2.0 * std::log(parameters.min_likelihood_ratio);
  }

  std::vector<Match> run() {
    // Likeliest first; then swaps that make the scan likelier.
    std::sort(all_.begin(), all_.end(), cheaper);
    for (const Candidate& c : all_) {
      if (partner_[c.observation] != kFree || owner_[c.track] != kFree) continue;
      pair(c.observation, c.track);
    }
    improve();

    std::vector<Match> matches;
    for (std::uint32_t i = 0; i < partner_.size(); ++i) {
      if (partner_[i] != kFree) matches.push_back({i, partner_[i], is_ambiguous(i)});
    }
    return matches;
  }

 private:
  static constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

  void pair(std::uint32_t observation, std::uint32_t track) {
    partner_[observation] = track;
    owner_[track] = observation;
  }

  void collect(std::span<const Observation> observations, const geometry::SE2WithCovariance& pose,
               double sigmas) {
    // The tracks, sorted into bins.
    geometry::GatedPoints gated(kBin_m, kVague_m2);
    for (const Track& track : tracks_) gated.add(track.position_m, track.variance_m2());
    gated.sort();

    // Each observation in the axes of `local`, with the covariance of the pose.
    const Eigen::Matrix2d rotation = pose.mean.rotation();
    for (std::uint32_t i = 0; i < observations.size() && all_.size() < kMostCandidates; ++i) {
      Eigen::Matrix<double, 2, 3> by_pose;
      by_pose << Eigen::Matrix2d::Identity(), geometry::perpendicular(observations[i].position_m);
      const Eigen::Matrix2d base =
          rotation *
              (observations[i].covariance_m2 + by_pose * pose.covariance * by_pose.transpose()) *
              rotation.transpose() +
          kGateFloor_m * kGateFloor_m / (sigmas * sigmas) * Eigen::Matrix2d::Identity();
      const Eigen::Vector2d at = pose.mean * observations[i].position_m;

      gated.for_each_near(at, sigmas, base.trace(), [&](std::uint32_t t, double) {
        const Track& track = tracks_[t];
        if (track.kind != observations[i].kind) return;
        const Eigen::Matrix2d spread = base + track.variance_m2() * Eigen::Matrix2d::Identity();
        const Eigen::Vector2d error = at - track.position_m;
        const double distance = error.dot(spread.inverse() * error);
        if (distance > sigmas * sigmas) return;

        const double reluctance = track.observations < kYoung ? kReluctance : 0.0;
        const Candidate c{distance + std::log(spread.determinant()) + reluctance, i, t};
        all_.push_back(c);
        by_observation_[i].push_back(c);
        by_track_[t].push_back(c);
      });
    }
  }

  double cost(std::uint32_t observation, std::uint32_t track) const {
    for (const Candidate& c : by_observation_[observation]) {
      if (c.track == track) return c.cost;
    }
    return kNone;
  }

  /// Swaps the tracks of two observations while that makes the scan likelier.
  void improve() {
    for (int round = 0; round < 3; ++round) {
      bool changed = false;
      for (std::uint32_t i = 0; i < partner_.size(); ++i) {
        if (partner_[i] == kFree) continue;
        for (const Candidate& c : by_observation_[i]) {
          const std::uint32_t j = owner_[c.track];
          if (j == kFree || j == i) continue;
          const std::uint32_t own = partner_[i];
          if (c.cost + cost(j, own) >= cost(i, own) + cost(j, c.track) - 1e-9) continue;

          pair(i, c.track);
          pair(j, own);
          changed = true;
          break;
        }
      }
      if (!changed) break;
    }
  }

  /// Whether the scan is nearly as likely with another track for observation `i`, whose own
  /// observation then takes the track of `i` (or none).
  bool is_ambiguous(std::uint32_t i) const {
    const std::uint32_t own = partner_[i];
    const double now = cost(i, own);
    for (const Candidate& c : by_observation_[i]) {
      // A single observation beside an older track is more likely an outlier or a false detection.
      const bool counts = tracks_[c.track].observations >= 2 || tracks_[own].observations < kYoung;
      if (c.track == own || !counts) continue;
      const std::uint32_t j = owner_[c.track];
      const double other =
          j == kFree ? c.cost - now : c.cost + cost(j, own) - now - cost(j, c.track);
      if (other < margin_) return true;
    }

    // Another observation without a track may belong to this track instead.
    return std::ranges::any_of(by_track_[own], [&](const Candidate& c) {
      return c.observation != i && partner_[c.observation] == kFree && c.cost - now < margin_;
    });
  }

  std::span<const Track> tracks_;
  std::vector<std::vector<Candidate>> by_observation_;
  std::vector<std::vector<Candidate>> by_track_;
  std::vector<Candidate> all_;
  std::vector<std::uint32_t> partner_;  ///< Track of each observation.
  std::vector<std::uint32_t> owner_;    ///< Observation of each track.
  double margin_ = 0.0;                 ///< Least difference of costs for an unambiguous match.
};

}  // namespace

std::vector<Match> match(std::span<const Track> tracks, std::span<const Observation> observations,
                         const geometry::SE2WithCovariance& local_T_vehicle,
                         const AssociatorParameters& parameters) {
  if (tracks.empty() || observations.empty()) return {};
  return Matcher(tracks, observations, local_T_vehicle, parameters).run();
}

}  // namespace understory::associator
