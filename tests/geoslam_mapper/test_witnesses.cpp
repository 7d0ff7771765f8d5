#include "services/geoslam_mapper/smoothing/witnesses.hpp"

#include <bit>
#include <random>

#include "tests/catch.hpp"

using namespace understory::geoslam_mapper::smoothing;

namespace {

/// Size of the largest set that contains `first` and agrees, by trying all sets.
int largest_by_brute_force(const std::vector<std::uint64_t>& agrees, std::size_t first) {
  int best = 0;
  for (std::uint64_t set = 0; set < (std::uint64_t{1} << agrees.size()); ++set) {
    if ((set >> first & 1U) == 0 || std::popcount(set) <= best) continue;
    bool all_agree = true;
    for (std::size_t i = 0; i < agrees.size(); ++i) {
      const std::uint64_t others = set & ~(std::uint64_t{1} << i);
      if ((set >> i & 1U) != 0 && (agrees[i] & others) != others) all_agree = false;
    }
    if (all_agree) best = std::popcount(set);
  }
  return best;
}

}  // namespace

TEST_CASE("The largest agreement is that of all sets", "[witnesses]") {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const std::size_t count = 1 + random() % 11;
    const double share = 0.2 + 0.7 * static_cast<double>(random() % 100) / 100.0;
    std::vector<std::uint64_t> agrees(count);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        if (static_cast<double>(random() % 1000) >= 1000.0 * share) continue;
        agrees[i] |= std::uint64_t{1} << k;
        agrees[k] |= std::uint64_t{1} << i;
      }
    }
    const std::size_t first = random() % count;
    const std::vector<std::size_t> found = largest_agreement(agrees, first);

    CAPTURE(trial, count, first);
    CHECK(static_cast<int>(found.size()) == largest_by_brute_force(agrees, first));
    CHECK(std::ranges::find(found, first) != found.end());
    for (const std::size_t i : found)
      for (const std::size_t k : found) CHECK((i == k || (agrees[i] >> k & 1U) != 0));
  }
}

TEST_CASE("Witnesses whose windows share landmarks count once", "[witnesses]") {
  // Forty windows of one place, two metres apart, each of them sure.
  std::vector<Witness> of_one_place;
  for (int i = 0; i < 9; ++i) of_one_place.push_back({100.0 + 2.0 * i, 900.0 + 2.0 * i, -100.0});
  CHECK(decades(of_one_place) < kBeyondDoubt);

  // The same vehicle along 100 m of the earlier path.
  std::vector<Witness> along;
  for (int i = 0; i < 50; ++i) along.push_back({100.0 + 2.0 * i, 900.0 + 2.0 * i, -100.0});
  CHECK(decades(along) >= kBeyondDoubt);

  // New windows that are all found in one old window.
  std::vector<Witness> in_one_place;
  for (int i = 0; i < 50; ++i) in_one_place.push_back({100.0, 900.0 + 30.0 * i, -100.0});
  CHECK(decades(in_one_place) < kBeyondDoubt);
}

TEST_CASE("Weak witnesses need more of them", "[witnesses]") {
  const auto apart = [](int count, double log10_false_alarm) {
    std::vector<Witness> witnesses;
    for (int i = 0; i < count; ++i)
      witnesses.push_back({50.0 * i, 2000.0 + 50.0 * i, log10_false_alarm});
    return decades(witnesses);
  };
  CHECK(apart(2, -10.0) < kBeyondDoubt);
  CHECK(apart(2, -12.0) >= kBeyondDoubt);
  CHECK(apart(3, -7.0) < kBeyondDoubt);
  CHECK(apart(4, -6.0) >= kBeyondDoubt);
  CHECK(apart(2, 0.0) < kBeyondDoubt);
  CHECK(apart(3, 0.0) >= kBeyondDoubt);
}
