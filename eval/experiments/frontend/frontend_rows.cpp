#include "eval/experiments/frontend/frontend_rows.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace understory::eval::experiments::frontend {

std::string FrontendRow::target() const {
  if (at_least && at_most) return fmt::format("{:g} .. {:g}", *at_least, *at_most);
  if (at_least) return fmt::format(">= {:g}", *at_least);
  if (at_most) return fmt::format("<= {:g}", *at_most);
  return "";
}

std::optional<bool> FrontendRow::pass() const {
  if (!at_least && !at_most) return std::nullopt;
  return std::isfinite(value) && value >= at_least.value_or(value) &&
         value <= at_most.value_or(value);
}

void FrontendRows::state(const std::string& what, double value, const std::string& unit) {
  rows_.push_back({what, value, unit, std::nullopt, std::nullopt, setting_});
}
void FrontendRows::at_least(const std::string& what, double value, const std::string& unit,
                            double target) {
  rows_.push_back({what, value, unit, target, std::nullopt, setting_});
}
void FrontendRows::at_most(const std::string& what, double value, const std::string& unit,
                           double target) {
  rows_.push_back({what, value, unit, std::nullopt, target, setting_});
}
void FrontendRows::between(const std::string& what, double value, const std::string& unit,
                           double low, double high) {
  rows_.push_back({what, value, unit, low, high, setting_});
}

nlohmann::json to_json(const std::vector<FrontendRow>& rows) {
  nlohmann::json result = nlohmann::json::array();
  for (const FrontendRow& row : rows) {
    nlohmann::json out = {{"setting", row.setting}, {"what", row.what},       {"value", row.value},
                          {"unit", row.unit},       {"target", row.target()}, {"pass", nullptr}};
    if (const auto pass = row.pass()) out["pass"] = *pass;
    result.push_back(std::move(out));
  }
  return result;
}

std::string to_table(const std::vector<FrontendRow>& rows) {
  std::string text;
  std::string setting;
  for (const FrontendRow& row : rows) {
    if (row.setting != setting) text += fmt::format("\n{}\n", row.setting);
    setting = row.setting;
    const auto pass = row.pass();
    text += fmt::format("  {:<44} {:>11.4g} {:<8} {:<14} {}\n", row.what, row.value, row.unit,
                        row.target(), !pass ? "" : (*pass ? "met" : "MISSED"));
  }
  return text;
}

}  // namespace understory::eval::experiments::frontend
