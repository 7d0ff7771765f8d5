#include "services/geoslam_mapper/smoothing/understatement.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace understory::geoslam_mapper::smoothing {

double Understatement::at(double along_m) const {
  const auto next = steps_.upper_bound(along_m);
  return next == steps_.begin() ? 1.0 : std::prev(next)->second;
}

double Understatement::least(double from_m, double to_m) const {
  double least = at(from_m);
  for (auto step = steps_.upper_bound(from_m); step != steps_.end() && step->first <= to_m; ++step)
    least = std::min(least, step->second);
  return least;
}

void Understatement::raise(double from_m, double to_m, double factor) {
  const double behind_m = std::nextafter(to_m, std::numeric_limits<double>::infinity());
  const double first = at(from_m);
  const double after = at(behind_m);
  steps_.emplace(from_m, first);
  steps_.emplace(behind_m, after);
  for (auto step = steps_.find(from_m); step->first < behind_m; ++step)
    step->second = std::max(step->second, factor);
}

}  // namespace understory::geoslam_mapper::smoothing
