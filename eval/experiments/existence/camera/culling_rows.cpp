#include <algorithm>
#include <cmath>

#include "eval/experiments/existence/camera/camera_rows.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

/// Mean, and half the width of its 95 % interval.
struct MeanOf {
  double mean = 0.0;
  double half = 0.0;
};

MeanOf mean_of(const std::vector<double>& values) {
  if (values.empty()) return {};
  const auto count = static_cast<double>(values.size());
  MeanOf result;
  for (const double value : values) result.mean += value / count;
  double squares = 0.0;
  for (const double value : values) squares += (value - result.mean) * (value - result.mean);
  if (values.size() > 1) result.half = 1.96 * std::sqrt(squares / (count - 1.0) / count);
  return result;
}

/// One method over all runs.
struct Pool {
  std::vector<ScoredPoint> scored, rest, hidden;
  std::vector<double> samples, errors_m, ate_m, map_points;
  std::size_t frames = 0, successes = 0, wrong = 0, tracked = 0, lost = 0;
  std::size_t gained = 0, given_up = 0;  ///< Frames found here alone, found without removal alone.
};

void add_queries(const MethodOnCase& one, const MethodOnCase& without, Pool& pool) {
  for (std::size_t k = 0; k < one.queries.size(); ++k) {
    const Query& query = one.queries[k];
    ++pool.frames;
    pool.successes += query.is_success ? 1 : 0;
    pool.wrong += query.is_wrong ? 1 : 0;
    pool.samples.push_back(query.samples);
    if (query.is_success) pool.errors_m.push_back(query.error_m);
    pool.gained += query.is_success && !without.queries[k].is_success ? 1 : 0;
    pool.given_up += !query.is_success && without.queries[k].is_success ? 1 : 0;
  }
}

Pool pool_of(const std::vector<const CaseResult*>& runs, std::size_t method) {
  Pool pool;
  for (const CaseResult* const run : runs) {
    const MethodOnCase& one = run->methods[method];
    add_queries(one, run->methods.front(), pool);
    pool.scored.insert(pool.scored.end(), one.scored.begin(), one.scored.end());
    pool.rest.insert(pool.rest.end(), one.rest.begin(), one.rest.end());
    pool.hidden.insert(pool.hidden.end(), one.hidden.begin(), one.hidden.end());
    pool.ate_m.push_back(one.ate_m);
    pool.map_points.push_back(static_cast<double>(one.map_points));
    pool.tracked += run->tracked_frames;
    pool.lost += static_cast<std::size_t>(one.lost);
  }
  return pool;
}

double percent(std::size_t part, std::size_t all) {
  return all == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(all);
}

double gone_pct(const std::vector<ScoredPoint>& points) {
  const auto gone = std::count_if(points.begin(), points.end(),
                                  [](const ScoredPoint& point) { return !point.exists; });
  return percent(static_cast<std::size_t>(gone), points.size());
}

nlohmann::json camera_part(const Pool& pool) {
  const Interval success = wilson_pct(pool.successes, pool.frames);
  const MeanOf samples = mean_of(pool.samples), ate = mean_of(pool.ate_m);
  return {{"frames", pool.frames},
          {"success_pct", percent(pool.successes, pool.frames)},
          {"success_low_pct", success.low},
          {"success_high_pct", success.high},
          {"gained_frames", pool.gained},
          {"given_up_frames", pool.given_up},
          {"wrong_accepted", pool.wrong},
          {"samples_mean", samples.mean},
          {"samples_half95", samples.half},
          {"error_p50_cm", 100.0 * tools::quantile(pool.errors_m, 0.5)},
          {"tracked_frames", pool.tracked},
          {"lost_pct", percent(pool.lost, pool.tracked)},
          {"ate_cm", 100.0 * ate.mean},
          {"ate_half95_cm", 100.0 * ate.half},
          {"map_points", mean_of(pool.map_points).mean}};
}

nlohmann::json points_part(const Pool& pool) {
  std::vector<ScoredPoint> all = pool.scored;
  all.insert(all.end(), pool.rest.begin(), pool.rest.end());
  return {{"scored_points", pool.scored.size()},
          {"gone_of_scored_pct", gone_pct(pool.scored)},
          {"gone_removed_pct", 100.0 * removed_share(pool.scored, false)},
          {"wrongly_removed_pct", 100.0 * removed_share(pool.scored, true)},
          {"auc", roc_area(pool.scored)},
          {"brier", brier_score(pool.scored)},
          {"hidden_points", pool.hidden.size()},
          {"hidden_removed_pct", 100.0 * removed_share(pool.hidden, true)},
          {"all_points", all.size()},
          {"all_gone_removed_pct", 100.0 * removed_share(all, false)},
          {"all_wrongly_removed_pct", 100.0 * removed_share(all, true)},
          {"all_auc", roc_area(all)},
          {"all_brier", brier_score(all)}};
}

}  // namespace

Interval wilson_pct(std::size_t hits, std::size_t all) {
  if (all == 0) return {0.0, 100.0};
  constexpr double kZ = 1.96;
  const auto n = static_cast<double>(all);
  const double share = static_cast<double>(hits) / n;
  const double scale = 1.0 + kZ * kZ / n;
  const double middle = (share + kZ * kZ / (2.0 * n)) / scale;
  const double half = kZ / scale * std::sqrt(share * (1.0 - share) / n + kZ * kZ / (4.0 * n * n));
  return {100.0 * std::max(0.0, middle - half), 100.0 * std::min(1.0, middle + half)};
}

nlohmann::json culling_rows(const std::vector<const CaseResult*>& runs,
                            const std::vector<CameraMethod>& methods) {
  nlohmann::json rows = nlohmann::json::array();
  const CaseSetting& setting = runs.front()->setting;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const Pool pool = pool_of(runs, m);
    nlohmann::json row{{"part", "culling"},
                       {"world", name_of_world(setting)},
                       {"occluders_alone", setting.has_occluders_alone},
                       {"changed_pct", 100.0 * setting.changed},
                       {"method", methods[m].tuned.name},
                       {"runs", runs.size()}};
    if (!methods[m].is_ablation) row.update(camera_part(pool));
    row.update(points_part(pool));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace understory::eval::experiments::existence::camera
