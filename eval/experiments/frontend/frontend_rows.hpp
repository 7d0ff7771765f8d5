// Rows of `understory eval frontend`: figures and their targets.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace understory::eval::experiments::frontend {

/// One figure of the table.
struct FrontendRow {
  std::string what;
  double value = 0.0;
  std::string unit;
  /// Bounds of the target; none = no target.
  std::optional<double> at_least;
  std::optional<double> at_most;
  std::string setting;  ///< Of what simulation or recording.

  /// The target for the table: ">= 0.9", "<= 3", "90 .. 99" or empty.
  std::string target() const;
  /// None where there is no target.
  std::optional<bool> pass() const;
};

/// A row for each figure of one subject; rows share `setting`.
class FrontendRows {
 public:
  /// Rows from here on are of this simulation or recording.
  void in(std::string setting) { setting_ = std::move(setting); }
  /// A figure without a target.
  void state(const std::string& what, double value, const std::string& unit);
  /// A figure that must not be below `target`.
  void at_least(const std::string& what, double value, const std::string& unit, double target);
  /// A figure that must not be above `target`.
  void at_most(const std::string& what, double value, const std::string& unit, double target);
  /// A figure that must be in [low, high].
  void between(const std::string& what, double value, const std::string& unit, double low,
               double high);
  /// All rows, in the order in which they were added.
  const std::vector<FrontendRow>& rows() const { return rows_; }

 private:
  std::string setting_;
  std::vector<FrontendRow> rows_;
};

/// A list of {"setting", "what", "value", "unit", "target", "pass"}; "pass" is null without a
/// target.
nlohmann::json to_json(const std::vector<FrontendRow>& rows);
/// A table for the terminal.
std::string to_table(const std::vector<FrontendRow>& rows);

}  // namespace understory::eval::experiments::frontend
