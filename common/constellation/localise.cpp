// ConstellationMap::localise: the search over triangle hypotheses.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/constellation/map.hpp"
#include "common/constellation/observation.hpp"
#include "common/constellation/pose.hpp"

namespace understory::constellation {
namespace constellation {
namespace {

/// Points looked at before a hypothesis is worth a refit on all.
constexpr std::size_t kTestPoints = 16;
/// Points whose triangles are tried first; as many again and again until all have been.
constexpr std::size_t kFirstPoints = 12;
/// What a refit on all points costs, in hypotheses that fail their test.
constexpr std::uint32_t kFitCost = 50;
/// Wald's thresholds on the log likelihood ratio.
constexpr double kReject = -1.9;
constexpr double kAccept = 9.0;
constexpr double kAcceptAtEnd = 2.5;

/// A rigid motion whose heading is kept as a unit vector: no trigonometry per hypothesis.
struct Motion {
  double c = 1.0;
  double s = 0.0;
  Eigen::Vector2d t = Eigen::Vector2d::Zero();
  Eigen::Vector2d operator*(const Eigen::Vector2d& p) const {
    return {c * p.x() - s * p.y() + t.x(), s * p.x() + c * p.y() + t.y()};
  }
};

/// A point on which hypotheses of one triangle are tested, about that triangle's centroid.
struct TestPoint {
  Eigen::Vector2d about_centroid;
  std::uint32_t point;
  double gate_m;
  double hit;   ///< Log likelihood ratio of right against wrong, if a landmark is in the gate...
  double miss;  ///< ... and if not.
};

/// One query triangle, with what all its hypotheses share.
struct Query {
  Triangle triangle;
  Eigen::Vector2d centroid;
  std::array<Eigen::Vector2d, 3> about_centroid;
  std::vector<TestPoint> tests;
};

class Search {
 public:
  Search(const ConstellationMap& map, const PreparedObservation& observation,
         const LocaliseParameters& parameters, const std::optional<Disc>& where)
      : map_(map),
        observation_(observation),
        parameters_(parameters),
        where_(where),
        source_(observation, parameters.neighbours) {}

  Localisation run();

 private:
  std::span<const Triangle> more_triangles();
  bool search(std::span<const Triangle> triangles, double side_sigmas);
  void look_for_runner_up(double side_sigmas);
  Query make_query(const Triangle& triangle) const;
  void add_tests(Query& query) const;
  std::array<float, 3> tolerance(const Triangle& triangle, double side_sigmas) const;
  Motion motion_from(const Query& query, const std::array<Slot, 3>& corners) const;
  std::optional<FittedPose> try_hypothesis(const Query& query, const std::array<Slot, 3>& corners);
  void consider(FittedPose pose);
  bool accepted() const {
    return best_ && false_alarm(*best_) <= parameters_.max_log10_false_alarm;
  }
  double false_alarm(const FittedPose& pose) const {
    return pose.log10_tail + std::log10(std::max<double>(hypotheses_, 1.0));
  }
  bool spent() const { return hypotheses_ + kFitCost * fits_ >= parameters_.max_hypotheses; }
  double margin() const { return (runner_up_ ? runner_up_->log10_tail : 0.0) - best_->log10_tail; }
  bool ambiguous() const { return margin() < parameters_.min_log10_margin; }
  Localisation result() const;

  const ConstellationMap& map_;
  const PreparedObservation& observation_;
  const LocaliseParameters& parameters_;
  const std::optional<Disc>& where_;
  TriangleSource source_;
  std::vector<Triangle> triangles_;  // taken from the source, in the order of trying
  std::size_t points_taken_ = 0;
  std::optional<FittedPose> best_;
  std::optional<FittedPose> runner_up_;  // at a different pose
  std::uint32_t hypotheses_ = 0;
  std::uint32_t fits_ = 0;
};

/// The triangles of some more points, the most telling of them first.
std::span<const Triangle> Search::more_triangles() {
  const std::size_t known = triangles_.size();
  const std::vector<Triangle> fresh = source_.take(std::max(kFirstPoints, points_taken_));
  points_taken_ += std::max(kFirstPoints, points_taken_);
  std::vector<std::uint64_t> order(fresh.size());
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    order[i] = (std::uint64_t{map_.triangle_index().crowd(fresh[i])} << 32) | i;
  }
  std::sort(order.begin(), order.end());
  for (const std::uint64_t key : order) triangles_.push_back(fresh[key & 0xFFFFFFFFU]);
  return std::span(triangles_).subspan(known);
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

Query Search::make_query(const Triangle& triangle) const {
  Query query;
  query.triangle = triangle;
  query.centroid = Eigen::Vector2d::Zero();
  for (const Slot vertex : triangle.vertex) {
    query.centroid += observation_.points[vertex].position / 3.0;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    query.about_centroid[i] = observation_.points[triangle.vertex[i]].position - query.centroid;
  }
  return query;
}

void Search::add_tests(Query& query) const {
  const auto& points = observation_.points;
  std::vector<std::pair<double, std::uint32_t>> order;
  order.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto& vertex = query.triangle.vertex;
    if (i == vertex[0] || i == vertex[1] || i == vertex[2]) continue;
    order.emplace_back((points[i].position - query.centroid).squaredNorm(), i);
  }
  // The nearest first: there the triangle's own error matters least and the gate is tightest.
  const std::size_t count = std::min(kTestPoints, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end());

  double variance = 0.0;
  double lever = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    variance += points[query.triangle.vertex[i]].variance / 3.0;
    lever += query.about_centroid[i].squaredNorm();
  }
  const double right = parameters_.expected_hit_ratio;
  query.tests.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const auto [squared, i] = order[k];
    const double gate_variance = points[i].variance + variance / 3.0 + variance * squared / lever;
    // Three sigmas: a miss is not final here.
    const double gate_m = std::min(3.0 * std::sqrt(gate_variance), parameters_.max_gate_m);
    const double wrong =
        std::min(0.9 * right, observation_.density_per_m2 * std::numbers::pi * gate_m * gate_m);
    query.tests[k] = {points[i].position - query.centroid, i, gate_m, std::log(right / wrong),
                      std::log((1.0 - right) / (1.0 - wrong))};
  }
}

Motion Search::motion_from(const Query& query, const std::array<Slot, 3>& corners) const {
  const std::array<Eigen::Vector2d, 3> landmark{map_.grid().position(corners[0]),
                                                map_.grid().position(corners[1]),
                                                map_.grid().position(corners[2])};
  const Eigen::Vector2d centroid = (landmark[0] + landmark[1] + landmark[2]) / 3.0;
  double dot = 0.0;
  double cross = 0.0;

  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d& p = query.about_centroid[i];
    const Eigen::Vector2d m = landmark[i] - centroid;
    dot += p.dot(m);
    cross += p.x() * m.y() - p.y() * m.x();
  }

  const double norm = std::sqrt(dot * dot + cross * cross);
  return {dot / norm, cross / norm, centroid};
}

/// The pose that the hypothesis leads to, if its sequential test is passed.
std::optional<FittedPose> Search::try_hypothesis(const Query& query,
                                                 const std::array<Slot, 3>& corners) {
  const Motion map_T_centroid = motion_from(query, corners);
  if (where_) {
    const Eigen::Vector2d sensor = map_T_centroid * Eigen::Vector2d(-query.centroid);
    if ((sensor - where_->centre_m).norm() > where_->radius_m) return std::nullopt;
  }
  ++hypotheses_;
  std::array<Slot, kTestPoints> hit{};
  double ratio = 0.0;
  std::size_t tested = 0;
  for (; tested < query.tests.size() && ratio < kAccept; ++tested) {
    const TestPoint& test = query.tests[tested];
    const Eigen::Vector2d mapped = map_T_centroid * test.about_centroid;
    double squared = 0.0;
    hit[tested] = nearest_slot(map_.grid(), mapped.x(), mapped.y(), test.gate_m, squared);
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
  ++fits_;
  FittedPose pose = fit_pose(observation_, map_.grid(), std::move(pairs), parameters_);
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
bool Search::search(std::span<const Triangle> triangles, double side_sigmas) {
  for (const Triangle& triangle : triangles) {
    Query query = make_query(triangle);
    map_.triangle_index().for_each_similar(triangle, tolerance(triangle, side_sigmas),
                                           [&](const TriangleIndex::Entry& entry) {
                                             if (query.tests.empty()) add_tests(query);
                                             if (auto pose = try_hypothesis(query, entry.vertex))
                                               consider(std::move(*pose));
                                             return !accepted() && !spent();
                                           });
    if (accepted()) return true;
    if (spent()) return false;
  }

  return false;
}

/// A scene that repeats elsewhere shows in the triangles of the accepted pose, of which the search
/// has looked at one only up to the accepted hypothesis. Those that find their own landmarks again
/// would find a copy of them too: so many are looked up to the end.
void Search::look_for_runner_up(double side_sigmas) {
  std::vector<Slot> explained(observation_.points.size(), kNoSlot);
  for (const Pair& pair : best_->pairs) explained[pair.point] = pair.slot;
  int probes = parameters_.runner_up_probes;

  for (const Triangle& triangle : triangles_) {
    if (probes <= 0 || spent() || ambiguous()) break;
    const std::array<Slot, 3> own{explained[triangle.vertex[0]], explained[triangle.vertex[1]],
                                  explained[triangle.vertex[2]]};
    if (own[0] == kNoSlot || own[1] == kNoSlot || own[2] == kNoSlot) continue;

    Query query = make_query(triangle);
    map_.triangle_index().for_each_similar(triangle, tolerance(triangle, side_sigmas),
                                           [&](const TriangleIndex::Entry& entry) {
                                             if (entry.vertex == own) {
                                               --probes;
                                               return true;
                                             }
                                             if (query.tests.empty()) add_tests(query);
                                             if (auto pose = try_hypothesis(query, entry.vertex))
                                               consider(std::move(*pose));
                                             return !spent();
                                           });
  }
}

Localisation Search::result() const {
  Localisation result;
  result.hypotheses = hypotheses_;
  if (!best_) {
    result.outcome = spent() ? LocaliseOutcome::kGaveUp : LocaliseOutcome::kNoMatch;
    return result;
  }

  result.map_T_sensor = best_->map_T_sensor;
  result.covariance = pose_covariance(observation_, *best_);
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

  if (!accepted()) {
    result.outcome = spent() ? LocaliseOutcome::kGaveUp : LocaliseOutcome::kLikelyChance;
  } else if (ambiguous()) {
    result.outcome = LocaliseOutcome::kAmbiguous;
  } else {
    result.outcome = LocaliseOutcome::kFound;
  }

  return result;
}

Localisation Search::run() {
  double side_sigmas = parameters_.narrow_side_sigmas;
  bool found = false;
  while (!found && !spent() && !source_.exhausted()) found = search(more_triangles(), side_sigmas);
  if (!found && !spent()) {
    side_sigmas = parameters_.wide_side_sigmas;
    found = search(triangles_, side_sigmas);
  }
  if (found) look_for_runner_up(side_sigmas);
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
