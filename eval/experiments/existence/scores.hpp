// How well probabilities of existence tell what is gone from what is there.
#pragma once

#include <array>
#include <utility>
#include <vector>

namespace understory::eval::experiments::existence {

/// A point's probability, and the truth.
struct ScoredPoint {
  double probability = 0.0;
  bool exists = true;
};

/// A bin of the reliability diagram.
struct ReliabilityBin {
  double stated = 0.0;     ///< Mean probability.
  double frequency = 0.0;  ///< Share that exists.
  std::size_t count = 0;
};

/// Area under the ROC of "gone": probability that a gone point has a lower P than one that is
/// there; ties count half. 1 where one kind is missing.
double roc_area(std::vector<ScoredPoint> points);
/// Standard deviation of such an area (Hanley & McNeil, Radiology 143, 1982) from so many that are
/// gone and that are there.
double sigma_of_area(double area, double gone, double there);
/// Average precision of "gone", lowest P first; points with the same P together.
double average_precision(std::vector<ScoredPoint> points);
/// Mean squared error of the probabilities.
double brier_score(const std::vector<ScoredPoint>& points);
/// Share of the gone that is found where a share of those that are there is removed with them;
/// linear within points of one P.
double found_at(std::vector<ScoredPoint> points, double wrongly_removed);
/// The ROC as (wrongly removed, found), at most about 200 corners.
std::vector<std::pair<double, double>> roc_curve(std::vector<ScoredPoint> points);
/// Ten bins of equal width.
std::array<ReliabilityBin, 10> reliability(const std::vector<ScoredPoint>& points);
/// A point is removed (not used, and not forgotten) below this P: to lose what is there costs four
/// times as much as to keep what is gone.
inline constexpr double kRemovedBelow = 0.2;
/// Share of those with a truth whose P is below kRemovedBelow.
double removed_share(const std::vector<ScoredPoint>& points, bool exists);

}  // namespace understory::eval::experiments::existence
