// Closures that the loop closer itself sends in the rows of a plantation.
#pragma once

#include "eval/experiments/closures/closure_drive.hpp"

namespace understory::eval::experiments::closures {

/// Rows of trees, and a vehicle that drives between them, down one gap and up another one.
struct PlantationPlan {
  double rows_m = 4.0;      ///< Between rows.
  double trees_m = 2.5;     ///< Between trees of a row.
  double sigma_m = 0.1;     ///< Of a tree about its place in the grid, per axis.
  double missing = 0.05;    ///< Share of places without a tree.
  double length_m = 120.0;  ///< Of a row.
  int gaps = 4;             ///< Driven one after the other.
  int skip = 2;             ///< Rows from one to the next.
};

/// Drives with a mapper that knows nothing but odometry, so that the loop closer looks everywhere.
/// Closures off by less than a metre are kRight, the others kRows.
ClosureDrive make_plantation_drive(const PlantationPlan& plan, const ClosurePlan& closures,
                                   std::uint64_t seed);

}  // namespace understory::eval::experiments::closures
