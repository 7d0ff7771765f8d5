// Sweeps that travel in parts.
#include "common/model/point_sweep.hpp"

#include <algorithm>
#include <stdexcept>

#include "tests/catch.hpp"

using namespace understory;

namespace {

model::PointSweep sweep_of(std::uint64_t revolution, std::size_t points) {
  model::PointSweep sweep;
  sweep.utime = 1'000'000 + static_cast<model::Utime>(revolution) * 100'000;
  sweep.revolution = revolution;
  sweep.rings = 16;
  for (std::size_t i = 0; i < points; ++i) sweep.points.emplace_back().x_m = static_cast<float>(i);
  return sweep;
}

}  // namespace

TEST_CASE("Parts join to the sweep that they were", "[model]") {
  model::SweepAssembler assembler;
  for (const std::size_t points : {0U, 1U, 10U, 11U, 30U}) {
    const model::PointSweep sweep = sweep_of(points, points);
    const auto parts = model::split_sweep(sweep, 10);
    REQUIRE(parts.size() == std::max<std::size_t>(1, (points + 9) / 10));
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) REQUIRE_FALSE(assembler.add(parts[i]));
    const auto whole = assembler.add(parts.back());
    REQUIRE(whole);
    CHECK(whole->part == 0);
    CHECK(whole->parts == 1);
    CHECK(whole->utime == sweep.utime);
    CHECK(whole->rings == 16);
    REQUIRE(whole->points.size() == points);
    for (std::size_t i = 0; i < points; ++i) CHECK(whole->points[i].x_m == static_cast<float>(i));
  }
  CHECK(assembler.incomplete_revolutions() == 0);
  CHECK_THROWS_AS(model::split_sweep(sweep_of(0, 1), 0), std::invalid_argument);
  CHECK_THROWS_AS(model::split_sweep(sweep_of(0, 65536), 1), std::invalid_argument);
}

TEST_CASE("A revolution without all its parts is dropped and counted once", "[model]") {
  model::SweepAssembler assembler;
  const auto first = model::split_sweep(sweep_of(1, 40), 10);
  const auto second = model::split_sweep(sweep_of(2, 20), 10);
  const auto third = model::split_sweep(sweep_of(3, 20), 10);
  // The second part of the first is lost, then the first part of the second.
  for (const std::size_t i : {0U, 2U, 3U}) CHECK_FALSE(assembler.add(first[i]));
  CHECK_FALSE(assembler.add(second[1]));
  CHECK(assembler.incomplete_revolutions() == 0);
  CHECK_FALSE(assembler.add(third[0]));
  CHECK(assembler.incomplete_revolutions() == 1);
  CHECK(assembler.add(third[1]));
  CHECK(assembler.incomplete_revolutions() == 2);
  // What is late by a revolution and more begins nothing.
  CHECK_FALSE(assembler.add(second[0]));
  const auto fourth = model::split_sweep(sweep_of(4, 5), 10);
  CHECK(assembler.add(fourth[0]));
}

TEST_CASE("Parts out of order join to the same sweep, those of two revolutions mixed", "[model]") {
  const auto first = model::split_sweep(sweep_of(1, 40), 10);
  const auto second = model::split_sweep(sweep_of(2, 20), 10);
  model::SweepAssembler assembler;
  for (const std::size_t i : {3U, 0U, 2U}) CHECK_FALSE(assembler.add(first[i]));
  CHECK_FALSE(assembler.add(second[1]));
  CHECK_FALSE(assembler.add(second[1]));
  const auto whole = assembler.add(first[1]);
  REQUIRE(whole);
  REQUIRE(whole->points.size() == 40);
  for (std::size_t i = 0; i < 40; ++i) CHECK(whole->points[i].x_m == static_cast<float>(i));
  CHECK(whole->part == 0);
  CHECK(assembler.add(second[0]));
  CHECK(assembler.incomplete_revolutions() == 0);
}
