#include "services/associator/consistent_set.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numeric>

namespace understory::associator {
namespace {

constexpr std::size_t kMaxObserved = 24;
constexpr std::size_t kMaxPairs = 512;
using Set = std::bitset<kMaxPairs>;

/// A possible pair.
struct Pair {
  double off_m = 0.0;  ///< Distance from the position predicted by the guess.
  ConsistencyPair ends;
};

/// Largest clique; of equal sets the first one found is kept, so results do not depend on the
/// platform.
class CliqueSearch {
 public:
  CliqueSearch(const std::vector<Set>& adjacent, int max_nodes)
      : adjacent_(adjacent), nodes_(max_nodes) {}

  std::vector<std::size_t> run() {
    Set all;
    for (std::size_t i = 0; i < adjacent_.size(); ++i) all.set(i);
    expand(all);
    return best_;
  }

 private:
  void expand(Set open) {
    if (nodes_-- <= 0) return;

    // Vertices of one colour exclude each other: the number of colours bounds the clique.
    std::vector<std::size_t> order;
    std::vector<std::size_t> colour;
    Set uncoloured = open;
    for (std::size_t c = 1; uncoloured.any(); ++c) {
      Set free = uncoloured;
      for (std::size_t v = free._Find_first(); v < kMaxPairs; v = free._Find_next(v)) {
        free &= ~adjacent_[v];
        uncoloured.reset(v);
        order.push_back(v);
        colour.push_back(c);
      }
    }

    // Branches on the vertices of the highest colour first.
    for (std::size_t k = order.size(); k-- > 0;) {
      if (current_.size() + colour[k] <= best_.size()) return;
      const std::size_t v = order[k];
      current_.push_back(v);
      const Set next = open & adjacent_[v];
      if (next.any()) {
        expand(next);
      } else if (current_.size() > best_.size()) {
        best_ = current_;
      }
      current_.pop_back();
      open.reset(v);
    }
  }

  const std::vector<Set>& adjacent_;
  int nodes_;
  std::vector<std::size_t> current_;
  std::vector<std::size_t> best_;
};

/// Indices of the observed points nearest to the origin.
std::vector<std::uint32_t> nearest(std::span<const ConsistencyPoint> observed) {
  std::vector<std::uint32_t> near(observed.size());
  std::iota(near.begin(), near.end(), 0u);
  std::stable_sort(near.begin(), near.end(), [&](std::uint32_t a, std::uint32_t b) {
    return observed[a].position_m.squaredNorm() < observed[b].position_m.squaredNorm();
  });
  if (near.size() > kMaxObserved) near.resize(kMaxObserved);
  return near;
}

/// Pairs of one kind within reach of the guess, nearest to it first.
std::vector<Pair> possible_pairs(std::span<const ConsistencyPoint> reference,
                                 std::span<const ConsistencyPoint> observed,
                                 const geometry::SE2& guess, const ConsistencyGate& gate) {
  std::vector<Pair> pairs;
  for (const std::uint32_t i : nearest(observed)) {
    const Eigen::Vector2d at = guess * observed[i].position_m;
    const double reach = gate.shift_m + gate.rotation_rad * observed[i].position_m.norm();
    for (std::uint32_t r = 0; r < reference.size(); ++r) {
      const double off = (reference[r].position_m - at).norm();
      if (reference[r].kind == observed[i].kind && off < reach) pairs.push_back({off, {r, i}});
    }
  }

  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.off_m < b.off_m; });
  if (pairs.size() > kMaxPairs) pairs.resize(kMaxPairs);
  return pairs;
}

/// Pairs that fit one rigid motion together.
std::vector<Set> compatibility(const std::vector<Pair>& pairs,
                               std::span<const ConsistencyPoint> reference,
                               std::span<const ConsistencyPoint> observed, double sigmas) {
  std::vector<Set> adjacent(pairs.size());
  for (std::size_t a = 0; a < pairs.size(); ++a) {
    const ConsistencyPair& p = pairs[a].ends;
    for (std::size_t b = a + 1; b < pairs.size(); ++b) {
      const ConsistencyPair& q = pairs[b].ends;
      if (p.reference == q.reference || p.observed == q.observed) continue;

      const ConsistencyPoint &r1 = reference[p.reference], &r2 = reference[q.reference];
      const ConsistencyPoint &o1 = observed[p.observed], &o2 = observed[q.observed];
      const double difference =
          (r1.position_m - r2.position_m).norm() - (o1.position_m - o2.position_m).norm();
      const double variance = r1.variance_m2 + r2.variance_m2 + o1.variance_m2 + o2.variance_m2;
      if (std::abs(difference) > sigmas * std::sqrt(variance)) continue;
      adjacent[a].set(b);
      adjacent[b].set(a);
    }
  }
  return adjacent;
}

}  // namespace

std::vector<ConsistencyPair> consistent_set(std::span<const ConsistencyPoint> reference,
                                            std::span<const ConsistencyPoint> observed,
                                            const geometry::SE2& guess,
                                            const ConsistencyGate& gate) {
  const std::vector<Pair> pairs = possible_pairs(reference, observed, guess, gate);
  const std::vector<Set> adjacent = compatibility(pairs, reference, observed, gate.sigmas);

  std::vector<ConsistencyPair> found;
  for (const std::size_t k : CliqueSearch(adjacent, gate.max_nodes).run()) {
    found.push_back(pairs[k].ends);
  }
  std::sort(found.begin(), found.end(), [](const ConsistencyPair& a, const ConsistencyPair& b) {
    return a.observed < b.observed;
  });
  return found;
}

}  // namespace understory::associator
