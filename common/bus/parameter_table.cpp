#include "common/bus/parameter_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/bus/config_layers.hpp"

namespace understory::bus {
namespace {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

/// The number in a form that TOML reads as floating point.
std::string number_as_toml(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string toml_text(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result.push_back('\\');
    result.push_back(c);
  }
  return result + "\"";
}

std::string with_unit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + " " + unit;
}

std::string default_as_toml(const ParameterTable::Entry& entry) {
  return std::visit(
      Overloaded{[](const ParameterTable::Number& n) { return number_as_toml(n.fallback); },
                 [](const ParameterTable::Integer& n) { return std::to_string(n.fallback); },
                 [](const ParameterTable::Boolean& b) {
                   return std::string(b.fallback ? "true" : "false");
                 },
                 [](const ParameterTable::Text& t) { return toml_text(t.fallback); }},
      entry.target);
}

}  // namespace

ConfigurationError::ConfigurationError(std::vector<std::string> problems)
    : std::runtime_error(joined(problems)), problems_(std::move(problems)) {}

std::string value_as_toml(const ParameterTable::Entry& entry) {
  return std::visit(
      Overloaded{
          [](const ParameterTable::Number& n) { return number_as_toml(*n.value); },
          [](const ParameterTable::Integer& n) { return std::to_string(*n.value); },
          [](const ParameterTable::Boolean& b) { return std::string(*b.value ? "true" : "false"); },
          [](const ParameterTable::Text& t) { return toml_text(*t.value); }},
      entry.target);
}

std::string allowed(const ParameterTable::Entry& entry) {
  return std::visit(
      Overloaded{
          [&](const ParameterTable::Number& n) {
            return with_unit(fmt::format("{} .. {}", n.range.lowest, n.range.highest), entry.unit);
          },
          [&](const ParameterTable::Integer& n) {
            return with_unit(fmt::format("{} .. {}", n.range.lowest, n.range.highest), entry.unit);
          },
          [](const ParameterTable::Boolean&) { return std::string("true or false"); },
          [](const ParameterTable::Text& t) {
            if (t.choices.empty()) return std::string("any text");
            std::string text = "one of";
            for (std::size_t i = 0; i < t.choices.size(); ++i) {
              text += (i == 0 ? " " : ", ") + toml_text(t.choices[i]);
            }
            return text;
          }},
      entry.target);
}

void ParameterTable::renamed(std::string old_key, std::string new_key) {
  old_keys_.push_back({std::move(old_key), std::move(new_key), {}});
}
void ParameterTable::removed(std::string old_key, std::string why) {
  old_keys_.push_back({std::move(old_key), {}, std::move(why)});
}

void ParameterTable::check_is_new(const std::string& key) const {
  if (key == kBaseKey) throw std::logic_error("parameter " + key + ": the key has another meaning");
  for (const Entry& entry : entries_) {
    if (entry.key == key) throw std::logic_error("parameter " + key + " is described twice");
  }
}

void ParameterTable::add(std::string key, double& value, Range<double> range, std::string unit,
                         std::string doc) {
  check_is_new(key);
  if (!(value >= range.lowest && value <= range.highest)) {
    throw std::logic_error("default of " + key + " is outside its own range");
  }
  entries_.push_back(
      {std::move(key), std::move(unit), std::move(doc), Number{&value, value, range}});
}

void ParameterTable::add(std::string key, int& value, Range<int> range, std::string unit,
                         std::string doc) {
  check_is_new(key);
  if (value < range.lowest || value > range.highest) {
    throw std::logic_error("default of " + key + " is outside its own range");
  }
  entries_.push_back(
      {std::move(key), std::move(unit), std::move(doc), Integer{&value, value, range}});
}

void ParameterTable::add(std::string key, bool& value, std::string doc) {
  check_is_new(key);
  entries_.push_back({std::move(key), "", std::move(doc), Boolean{&value, value}});
}

void ParameterTable::add(std::string key, std::string& value, std::vector<std::string> choices,
                         std::string doc) {
  check_is_new(key);
  entries_.push_back({std::move(key), "", std::move(doc), Text{&value, value, std::move(choices)}});
}

std::string ParameterTable::to_toml() const {
  // Keys without a table come first: after a table's header they would belong to that table.
  std::vector<std::pair<std::string, std::string>> tables{{"", ""}};
  for (const Entry& entry : entries_) {
    const std::size_t dot = entry.key.rfind('.');
    const bool has_table = dot != std::string::npos;
    const std::string table = has_table ? entry.key.substr(0, dot) : "";
    auto found = std::find_if(tables.begin(), tables.end(),
                              [&](const auto& one) { return one.first == table; });
    if (found == tables.end()) found = tables.insert(tables.end(), {table, ""});
    found->second += fmt::format("# {} Allowed: {}.\n{} = {}\n", entry.doc, allowed(entry),
                                 entry.key.substr(has_table ? dot + 1 : 0), value_as_toml(entry));
  }

  std::string text = tables.front().second;
  for (std::size_t i = 1; i < tables.size(); ++i) {
    text += fmt::format("\n[{}]\n{}", tables[i].first, tables[i].second);
  }

  return text;
}

std::string ParameterTable::help() const {
  std::string text;
  for (const Entry& entry : entries_) {
    text += fmt::format("  {} = {}\n      {} Allowed: {}.\n", entry.key, default_as_toml(entry),
                        entry.doc, allowed(entry));
  }
  return text;
}

}  // namespace understory::bus
