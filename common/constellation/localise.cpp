// ConstellationMap::localise: the search over triangle hypotheses.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/constellation/hypothesis.hpp"
#include "common/constellation/map.hpp"
#include "common/constellation/observation.hpp"
#include "common/constellation/pose.hpp"
#include "common/constellation/settle.hpp"

namespace understory::constellation {
namespace constellation {
namespace {

/// Points whose triangles are tried first; then as many again, until all are tried.
constexpr std::size_t kFirstPoints = 12;
/// The same for isolated points: in a dense area only their triangles are distinctive.
constexpr std::size_t kFirstHermits = 96;
/// Triangles of isolated points are formed among this many nearest ones: some have no counterpart
/// in the map.
constexpr int kHermitNeighbours = 8;
/// Wald's thresholds on the log likelihood ratio.
constexpr double kReject = -1.9;
constexpr double kAccept = 9.0;
constexpr double kAcceptAtEnd = 2.5;

/// Triangles of one kind: of all points, or of isolated points.
struct Kind {
  TriangleSource source;
  const TriangleIndex* index = nullptr;  ///< Index of the map's triangles of that kind.
  std::size_t first_points = kFirstPoints;
  std::size_t taken = 0;  ///< Points whose triangles are in use.
};

/// A triangle of the observation and the place of similar ones in the index.
struct Candidate {
  Triangle triangle;
  const TriangleIndex* index = nullptr;
};

class Search {
 public:
  Search(const ConstellationMap& map, const PreparedObservation& observation,
         const LocaliseParameters& parameters, const std::optional<Disc>& where);

  Localisation run();

 private:
  std::span<const Candidate> more_triangles();
  bool exhausted() const;
  bool search(std::span<const Candidate> candidates, double side_sigmas);
  void look_for_runner_up(double side_sigmas);
  std::array<float, 3> tolerance(const Triangle& triangle, double side_sigmas) const;
  std::optional<FittedPose> try_hypothesis(const TriangleQuery& query,
                                           const std::array<Slot, 3>& corners);
  void consider(FittedPose pose);
  void settle_best();
  bool accepted() const {
    return best_ && false_alarm(*best_) <= parameters_.max_log10_false_alarm;
  }
  double false_alarm(const FittedPose& pose) const {
    return pose.log10_tail + std::log10(std::max<double>(hypotheses_, 1.0));
  }
  bool spent() const { return lookups_ >= parameters_.max_lookups; }
  double margin() const;
  bool ambiguous() const { return margin() < parameters_.min_log10_margin; }
  LocaliseOutcome outcome() const;
  Localisation result() const;

  const ConstellationMap& map_;
  const PreparedObservation& observation_;
  const LocaliseParameters& parameters_;
  const std::optional<Disc>& where_;
  std::vector<Kind> kinds_;
  std::vector<Candidate> candidates_;  // taken from the sources, in the order of trying
  std::optional<FittedPose> best_;
  std::optional<FittedPose> runner_up_;  // at a different pose
  std::optional<SettledPose> settled_;   // of the accepted best pose
  std::uint32_t hypotheses_ = 0;
  std::uint32_t lookups_ = 0;
};

Search::Search(const ConstellationMap& map, const PreparedObservation& observation,
               const LocaliseParameters& parameters, const std::optional<Disc>& where)
    : map_(map), observation_(observation), parameters_(parameters), where_(where) {
  std::vector<std::uint32_t> all(observation.points.size());
  std::iota(all.begin(), all.end(), 0U);
  kinds_.push_back({TriangleSource(observation, all, parameters.neighbours), &map.triangle_index(),
                    kFirstPoints, 0});
  for (const Hermits& hermits : map.hermits()) {
    if (hermits.triangles().size() == 0) continue;
    const auto apart = points_apart(observation, hermits.apart_m());
    if (apart.size() < 3) continue;
    kinds_.push_back({TriangleSource(observation, apart, kHermitNeighbours), &hermits.triangles(),
                      kFirstHermits, 0});
  }
}

bool Search::exhausted() const {
  return std::all_of(kinds_.begin(), kinds_.end(),
                     [](const Kind& kind) { return kind.source.exhausted(); });
}

/// Takes the triangles of some more points, those with the fewest candidates first.
std::span<const Candidate> Search::more_triangles() {
  const std::size_t known = candidates_.size();
  std::vector<Candidate> fresh;
  for (Kind& kind : kinds_) {
    const std::size_t count = std::max(kind.first_points, kind.taken);
    for (const Triangle& triangle : kind.source.take(count))
      fresh.push_back({triangle, kind.index});
    kind.taken += count;
  }
  std::vector<std::uint64_t> order(fresh.size());
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    order[i] = (std::uint64_t{fresh[i].index->crowd(fresh[i].triangle)} << 32) | i;
  }
  std::sort(order.begin(), order.end());
  for (const std::uint64_t key : order) candidates_.push_back(fresh[key & 0xFFFFFFFFU]);
  return std::span(candidates_).subspan(known);
}

std::array<float, 3> Search::tolerance(const Triangle& triangle, double side_sigmas) const {
  std::array<float, 3> result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double variance = observation_.points[triangle.vertex[(i + 1) % 3]].variance +
                            observation_.points[triangle.vertex[(i + 2) % 3]].variance;
    result[i] = static_cast<float>(side_sigmas * std::sqrt(variance));
  }
  return result;
}

/// The fitted pose of the hypothesis, if it passes its sequential test.
std::optional<FittedPose> Search::try_hypothesis(const TriangleQuery& query,
                                                 const std::array<Slot, 3>& corners) {
  const PointGrid& grid = map_.grid();
  const UnitMotion map_T_centroid = query.motion_to(
      {grid.position(corners[0]), grid.position(corners[1]), grid.position(corners[2])});
  ++hypotheses_;
  ++lookups_;
  if (where_) {
    const Eigen::Vector2d sensor = map_T_centroid * Eigen::Vector2d(-query.centroid);
    if ((sensor - where_->centre_m).norm() > where_->radius_m) return std::nullopt;
  }
  std::array<Slot, TriangleQuery::kTestPoints> hit{};
  double ratio = 0.0;
  std::size_t tested = 0;
  for (; tested < query.tests.size() && ratio < kAccept; ++tested) {
    const TestPoint& test = query.tests[tested];
    const Eigen::Vector2d mapped = map_T_centroid * test.about_centroid;
    double squared = 0.0;
    hit[tested] = nearest_slot(grid, mapped.x(), mapped.y(), test.gate_m, squared);
    ++lookups_;
    ratio += hit[tested] == kNoSlot ? test.miss : test.hit;
    if (ratio < kReject) return std::nullopt;
  }
  if (ratio < std::min(kAcceptAtEnd, 0.5 * static_cast<double>(tested))) return std::nullopt;

  std::vector<Pair> pairs;
  pairs.reserve(observation_.points.size());
  for (std::size_t i = 0; i < 3; ++i) pairs.push_back({query.triangle.vertex[i], corners[i], 0.0});
  for (std::size_t k = 0; k < tested; ++k) {
    if (hit[k] != kNoSlot) pairs.push_back({query.tests[k].point, hit[k], 0.0});
  }
  FittedPose pose = fit_pose(observation_, grid, pairs, parameters_);
  lookups_ += pose.lookups;
  if (pose.pairs.size() < 3) return std::nullopt;
  return pose;
}

void Search::consider(FittedPose pose) {
  if (best_ && same_pose(*best_, pose)) {
    if (pose.log10_tail < best_->log10_tail) best_ = std::move(pose);
    return;
  }
  if (!best_) {
    best_ = std::move(pose);
  } else if (pose.log10_tail < best_->log10_tail) {
    runner_up_ = std::move(best_);
    best_ = std::move(pose);
  } else if (!runner_up_ || pose.log10_tail < runner_up_->log10_tail) {
    runner_up_ = std::move(pose);
  }
}

/// True as soon as a pose is found that chance does not explain.
bool Search::search(std::span<const Candidate> candidates, double side_sigmas) {
  for (const Candidate& candidate : candidates) {
    TriangleQuery query(candidate.triangle, observation_);
    candidate.index->for_each_similar(candidate.triangle,
                                      tolerance(candidate.triangle, side_sigmas),
                                      [&](const TriangleIndex::Entry& entry) {
                                        if (query.tests.empty())
                                          query.add_tests(observation_, parameters_);
                                        if (auto pose = try_hypothesis(query, entry.vertex))
                                          consider(std::move(*pose));
                                        return !accepted() && !spent();
                                      });
    if (accepted()) return true;
    if (spent()) return false;
  }

  return false;
}

/// A repeated scene has copies of the accepted pose's triangles, but the search stopped at the
/// first accepted hypothesis. Some triangles of the accepted pose are therefore looked up
/// completely; a copy of their landmarks would be found as well.
void Search::look_for_runner_up(double side_sigmas) {
  std::vector<Slot> explained(observation_.points.size(), kNoSlot);
  for (const Pair& pair : best_->pairs) explained[pair.point] = pair.slot;
  int probes = parameters_.runner_up_probes;

  for (const Candidate& candidate : candidates_) {
    if (probes <= 0 || spent() || ambiguous()) break;
    const auto& vertex = candidate.triangle.vertex;
    const std::array<Slot, 3> own{explained[vertex[0]], explained[vertex[1]], explained[vertex[2]]};
    if (own[0] == kNoSlot || own[1] == kNoSlot || own[2] == kNoSlot) continue;

    TriangleQuery query(candidate.triangle, observation_);
    candidate.index->for_each_similar(candidate.triangle,
                                      tolerance(candidate.triangle, side_sigmas),
                                      [&](const TriangleIndex::Entry& entry) {
                                        if (entry.vertex == own) {
                                          --probes;
                                          return true;
                                        }
                                        if (query.tests.empty())
                                          query.add_tests(observation_, parameters_);
                                        if (auto pose = try_hypothesis(query, entry.vertex))
                                          consider(std::move(*pose));
                                        return !spent();
                                      });
  }
}

void Search::settle_best() {
  settled_ = settle(observation_, map_.grid(), *best_, parameters_);
  if (!settled_) return;
  lookups_ += settled_->lookups;
  best_ = settled_->pose;
}

double Search::margin() const {
  const double elsewhere = (runner_up_ ? runner_up_->log10_tail : 0.0) - best_->log10_tail;
  return settled_ ? std::min(elsewhere, settled_->log10_margin) : elsewhere;
}

LocaliseOutcome Search::outcome() const {
  if (!best_) return spent() ? LocaliseOutcome::kGaveUp : LocaliseOutcome::kNoMatch;
  if (!accepted()) return spent() ? LocaliseOutcome::kGaveUp : LocaliseOutcome::kLikelyChance;
  return !settled_ || ambiguous() ? LocaliseOutcome::kAmbiguous : LocaliseOutcome::kFound;
}

Localisation Search::result() const {
  Localisation result;
  result.hypotheses = hypotheses_;
  result.lookups = lookups_;
  result.outcome = outcome();
  if (!best_) return result;

  result.map_T_sensor = best_->map_T_sensor;
  if (settled_) result.covariance = settled_->covariance;
  result.inliers = static_cast<std::uint32_t>(best_->pairs.size());
  result.associations.reserve(best_->pairs.size());
  for (const Pair& pair : best_->pairs) {
    result.associations.push_back(
        {observation_.observed[pair.point], map_.id_of(pair.slot), std::sqrt(pair.squared_m2)});
  }
  result.log10_false_alarm = false_alarm(*best_);
  result.log10_margin = margin();
  if (runner_up_) {
    result.runner_up_inliers = static_cast<std::uint32_t>(runner_up_->pairs.size());
  }
  return result;
}

Localisation Search::run() {
  double side_sigmas = parameters_.narrow_side_sigmas;
  bool found = false;
  while (!found && !spent() && !exhausted()) found = search(more_triangles(), side_sigmas);
  if (!found && !spent()) {
    side_sigmas = parameters_.wide_side_sigmas;
    found = search(candidates_, side_sigmas);
  }
  if (found) {
    settle_best();
    look_for_runner_up(side_sigmas);
  }
  return result();
}

}  // namespace
}  // namespace constellation

Localisation ConstellationMap::localise(std::span<const ObservedPoint> points,
                                        const LocaliseParameters& parameters,
                                        const std::optional<Disc>& where) const {
  const auto observation = prepare(points, parameters);
  if (observation.points.size() < 3 || triangle_count() == 0) {
    Localisation none;
    none.outcome = LocaliseOutcome::kTooFewPoints;
    return none;
  }
  return constellation::Search(*this, observation, parameters, where).run();
}

}  // namespace understory::constellation
