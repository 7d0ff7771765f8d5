// From the runs of a cell to a row of the table.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "eval/harness/campaign.hpp"

namespace understory::eval::harness {

/// Mean and spread of a figure over runs.
struct Statistics {
  double mean = 0.0;
  double standard_deviation = 0.0;  ///< Of the sample (n - 1); 0 for fewer than two.
};
/// Of the values; zeros where there are none.
Statistics statistics_of(const std::vector<double>& values);

/// One method in one cell.
struct Summary {
  Cell cell;
  std::string method;
  bool has_ideal_scans = true;  ///< Else the cell's noise and the oracle mean nothing.
  bool has_map = true;          ///< Else poses alone.
  int runs = 0;
  Statistics rpe_cm;
  Statistics lpe_cm;
  Statistics roe_deg;
  Statistics ate_cm;
  double ratio = 0.0;      ///< Mean RPE over the oracle's; 0 = no oracle or a perfect one.
  double ratio_lpe = 0.0;  ///< The same for LPE.
  double updates = 0.0;    ///< Mean per run.
  int updates_possible = 0;
  int wrong_updates = 0;       ///< Sum over the runs.
  int runs_with_new_maps = 0;  ///< Whose map was lost: errors there are in the first map's frame.
  double map_recall_pct = 0.0;
  double false_landmarks_pct = 0.0;
  double landmarks_in_range = 0.0;
  double nees = 0.0;              ///< Mean; 3 is right. 0 = no covariance.
  double nees_in_band_pct = 0.0;  ///< Keyframes whose mean NEES is in its 95 % chi^2 band.
  std::vector<double> rpe_cm_runs;
  std::vector<double> lpe_cm_runs;
};

/// All methods of all cells, in the order of `methods`.
std::vector<Summary> summarise(const std::vector<CellResult>& cells,
                               const std::vector<std::string>& methods);

/// The two-sided 95 % band of chi^2 with `dof` degrees of freedom by boost::math.
std::pair<double, double> chi2_band_95(double dof);

/// One object of a result document's "rows"; keys end with the unit.
nlohmann::json to_json(const Summary& summary);
/// The table for the screen, the published figures in the last columns.
std::string to_table(const std::vector<Summary>& rows);

}  // namespace understory::eval::harness
