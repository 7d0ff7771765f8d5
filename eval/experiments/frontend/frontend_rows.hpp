// Rows of `understory eval frontend`: what was measured, and what it is held to.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace understory::eval::experiments::frontend {

struct FrontendRow {
  std::string what;
  double value = 0.0;
  std::string unit;
  /// What the value must not go below or beyond; none = stated, not judged.
  std::optional<double> at_least;
  std::optional<double> at_most;
  std::string setting;  ///< Of what simulation or recording.

  std::string target() const;
  /// None where there is no target.
  std::optional<bool> pass() const;
};

/// A row for each figure of one subject; rows share `setting`.
class FrontendRows {
 public:
  void in(std::string setting) { setting_ = std::move(setting); }
  void state(const std::string& what, double value, const std::string& unit);
  void at_least(const std::string& what, double value, const std::string& unit, double target);
  void at_most(const std::string& what, double value, const std::string& unit, double target);
  void between(const std::string& what, double value, const std::string& unit, double low,
               double high);
  const std::vector<FrontendRow>& rows() const { return rows_; }

 private:
  std::string setting_;
  std::vector<FrontendRow> rows_;
};

nlohmann::json to_json(const std::vector<FrontendRow>& rows);
/// A table for the terminal.
std::string to_table(const std::vector<FrontendRow>& rows);

}  // namespace understory::eval::experiments::frontend
