#include "eval/experiments/existence/scores.hpp"

#include <algorithm>
#include <cmath>

namespace understory::eval::experiments::existence {
namespace {

/// Points of one P: how many are gone, how many there.
struct Tie {
  double gone = 0.0;
  double there = 0.0;
};

/// From the lowest P on.
std::vector<Tie> ties_of(std::vector<ScoredPoint>& points) {
  std::sort(points.begin(), points.end(), [](const ScoredPoint& a, const ScoredPoint& b) {
    return a.probability < b.probability;
  });
  std::vector<Tie> ties;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i == 0 || points[i].probability != points[i - 1].probability) ties.emplace_back();
    (points[i].exists ? ties.back().there : ties.back().gone) += 1.0;
  }
  return ties;
}

Tie sum_of(const std::vector<Tie>& ties) {
  Tie sum;
  for (const Tie& tie : ties) {
    sum.gone += tie.gone;
    sum.there += tie.there;
  }
  return sum;
}

}  // namespace

double roc_area(std::vector<ScoredPoint> points) {
  const std::vector<Tie> ties = ties_of(points);
  const Tie sum = sum_of(ties);
  if (sum.gone == 0.0 || sum.there == 0.0) return 1.0;
  double area = 0.0;
  double found = 0.0;
  for (const Tie& tie : ties) {
    area += tie.there * (found + 0.5 * tie.gone);
    found += tie.gone;
  }
  return area / sum.gone / sum.there;
}

double sigma_of_area(double area, double gone, double there) {
  const double q1 = area / (2.0 - area), q2 = 2.0 * area * area / (1.0 + area);
  const double variance = (area * (1.0 - area) + (gone - 1.0) * (q1 - area * area) +
                           (there - 1.0) * (q2 - area * area)) /
                          (gone * there);
  return std::sqrt(std::max(0.0, variance));
}

double average_precision(std::vector<ScoredPoint> points) {
  const std::vector<Tie> ties = ties_of(points);
  const Tie sum = sum_of(ties);
  if (sum.gone == 0.0) return 1.0;
  double precision = 0.0, found = 0.0, removed = 0.0;
  for (const Tie& tie : ties) {
    found += tie.gone;
    removed += tie.gone + tie.there;
    precision += tie.gone * found / removed;
  }
  return precision / sum.gone;
}

double brier_score(const std::vector<ScoredPoint>& points) {
  double sum = 0.0;
  for (const ScoredPoint& point : points) {
    const double error = point.probability - (point.exists ? 1.0 : 0.0);
    sum += error * error;
  }
  return points.empty() ? 0.0 : sum / static_cast<double>(points.size());
}

double found_at(std::vector<ScoredPoint> points, double wrongly_removed) {
  const std::vector<Tie> ties = ties_of(points);
  const Tie sum = sum_of(ties);
  if (sum.gone == 0.0) return 1.0;
  double budget = wrongly_removed * sum.there;
  double found = 0.0;
  for (const Tie& tie : ties) {
    const double share = tie.there > budget ? budget / tie.there : 1.0;
    found += share * tie.gone;
    budget -= share * tie.there;
    if (share < 1.0) break;
  }
  return found / sum.gone;
}

std::vector<std::pair<double, double>> roc_curve(std::vector<ScoredPoint> points) {
  const std::vector<Tie> ties = ties_of(points);
  const Tie sum = sum_of(ties);
  std::vector<std::pair<double, double>> curve{{0.0, 0.0}};
  if (sum.gone == 0.0 || sum.there == 0.0) return curve;
  const std::size_t step = 1 + ties.size() / 200;
  Tie passed;
  for (std::size_t i = 0; i < ties.size(); ++i) {
    passed.gone += ties[i].gone;
    passed.there += ties[i].there;
    if (i % step == 0 || i + 1 == ties.size())
      curve.emplace_back(passed.there / sum.there, passed.gone / sum.gone);
  }
  return curve;
}

std::array<ReliabilityBin, 10> reliability(const std::vector<ScoredPoint>& points) {
  std::array<ReliabilityBin, 10> bins{};
  for (const ScoredPoint& point : points) {
    const auto index = static_cast<std::size_t>(std::clamp(10.0 * point.probability, 0.0, 9.0));
    bins[index].stated += point.probability;
    bins[index].frequency += point.exists ? 1.0 : 0.0;
    ++bins[index].count;
  }
  for (ReliabilityBin& bin : bins) {
    if (bin.count == 0) continue;
    bin.stated /= static_cast<double>(bin.count);
    bin.frequency /= static_cast<double>(bin.count);
  }
  return bins;
}

double removed_share(const std::vector<ScoredPoint>& points, bool exists) {
  std::size_t removed = 0, all = 0;
  for (const ScoredPoint& point : points) {
    if (point.exists != exists) continue;
    ++all;
    removed += point.probability < kRemovedBelow ? 1 : 0;
  }
  return all == 0 ? 0.0 : static_cast<double>(removed) / static_cast<double>(all);
}

}  // namespace understory::eval::experiments::existence
