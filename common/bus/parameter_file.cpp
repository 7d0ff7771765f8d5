// Loading and checking: all faults are found before any value is set.
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <sstream>

#include "common/bus/config_file.hpp"
#include "common/bus/config_layers.hpp"
#include "common/bus/parameter_table.hpp"

namespace understory::bus {
namespace {

/// Levenshtein's distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string nearest_key(const std::string& key, const std::vector<ParameterTable::Entry>& entries) {
  std::string nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const ParameterTable::Entry& entry : entries) {
    const std::size_t distance = edit_distance(key, entry.key);
    if (distance < least) nearest = entry.key;
    least = std::min(least, distance);
  }
  return nearest;
}

std::string shown(const toml::node& node) {
  std::ostringstream text;
  if (node.is_string()) {
    text << '"' << node.as_string()->get() << '"';
  } else if (const auto* number = node.as_floating_point()) {
    text << fmt::format("{}", number->get());
  } else if (node.is_integer()) {
    text << node.as_integer()->get();
  } else if (node.is_boolean()) {
    text << (node.as_boolean()->get() ? "true" : "false");
  } else {
    text << "a " << node.type();
  }

  return text.str();
}

/// The number as a double; none for a whole number without an equal double. (toml++ itself returns
/// none for every whole number above 2^53.)
std::optional<double> exact_double(const toml::node& number) {
  if (const auto* real = number.as_floating_point()) return real->get();
  const std::int64_t whole = number.as_integer()->get();
  const auto nearest = static_cast<double>(whole);
  // 2^63 is a double, but no int64: a number that rounds up to it is not exact and must not be cast
  // back.
  const bool is_exact = nearest < 0x1p63 && static_cast<std::int64_t>(nearest) == whole;
  return is_exact ? std::optional(nearest) : std::nullopt;
}

/// A value that passed every check; set after the whole file has passed.
struct Setting {
  const ParameterTable::Entry* entry = nullptr;
  std::variant<double, int, bool, std::string> value;
};

class Loader {
 public:
  Loader(const std::vector<ParameterTable::Entry>& entries,
         const std::vector<ParameterTable::OldKey>& old_keys)
      : entries_(entries), old_keys_(old_keys) {}

  /// Takes a file; it replaces values of the same keys in earlier files.
  void take(const ConfigLayer& layer) {
    name_ = layer.name;
    walk(layer.table, "");
  }

  void finish() {
    if (!problems_.empty()) throw ConfigurationError(problems_);
    for (const Setting& setting : settings_) set(setting);
  }

 private:
  void walk(const toml::table& table, const std::string& prefix) {
    for (const auto& [key, node] : table) {
      const std::string path = prefix + std::string(key.str());
      if (path == kBaseKey) continue;
      const ParameterTable::Entry* entry = find(path);
      if (entry != nullptr) {
        take(*entry, node);
      } else if (const toml::table* inner = node.as_table(); inner != nullptr && is_table(path)) {
        walk(*inner, path + ".");
      } else if (const std::string became = what_became_of(path); !became.empty()) {
        problem(node, path, became);
      } else {
        problem(node, path, "unknown key; the nearest valid one is " + nearest_key(path, entries_));
      }
    }
  }

  const ParameterTable::Entry* find(const std::string& path) const {
    const auto found = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const auto& entry) { return entry.key == path; });
    return found == entries_.end() ? nullptr : &*found;
  }
  bool is_table(const std::string& path) const {
    const auto is_inside = [&](const std::string& key) { return key.starts_with(path + "."); };
    return std::any_of(entries_.begin(), entries_.end(),
                       [&](const auto& entry) { return is_inside(entry.key); }) ||
           std::any_of(old_keys_.begin(), old_keys_.end(),
                       [&](const auto& old) { return is_inside(old.name); });
  }

  /// The message for a key of an older version; empty where the key is none. The longest matching
  /// rule applies: a key renamed within a renamed table has its own rule.
  std::string what_became_of(const std::string& path) const {
    const ParameterTable::OldKey* best = nullptr;
    for (const ParameterTable::OldKey& rule : old_keys_) {
      const bool is_whole_table = rule.name.ends_with('.');
      const bool fits = is_whole_table ? path.starts_with(rule.name) : path == rule.name;
      if (fits && (best == nullptr || rule.name.size() > best->name.size())) best = &rule;
    }
    if (best == nullptr) return {};
    if (best->new_name.empty()) return "was removed: " + best->why_removed;
    if (!best->name.ends_with('.')) return "is now called " + best->new_name;
    return "is now called " + best->new_name + path.substr(best->name.size());
  }

  void problem(const toml::node& node, const std::string& key, const std::string& what) {
    problems_.push_back(fmt::format("{}:{}: {}: {}", name_, node.source().begin.line, key, what));
  }
  void refuse(const ParameterTable::Entry& entry, const toml::node& node, std::string_view what) {
    problem(node, entry.key, fmt::format("{} {}; allowed: {}", shown(node), what, allowed(entry)));
  }

  void take(const ParameterTable::Entry& entry, const toml::node& node) {
    std::visit([&](const auto& target) { take(entry, target, node); }, entry.target);
  }
  void take(const ParameterTable::Entry& entry, const ParameterTable::Number& target,
            const toml::node& node) {
    if (!node.is_number()) return refuse(entry, node, "is not a number");
    const std::optional<double> value = exact_double(node);
    if (!value) return refuse(entry, node, "has more digits than a real number holds");
    if (!std::isfinite(*value)) return refuse(entry, node, "is not finite");
    if (*value < target.range.lowest) return refuse(entry, node, "is too small");
    if (*value > target.range.highest) return refuse(entry, node, "is too large");
    settings_.push_back({&entry, *value});
  }
  void take(const ParameterTable::Entry& entry, const ParameterTable::Integer& target,
            const toml::node& node) {
    if (!node.is_integer()) return refuse(entry, node, "is not a whole number");
    const std::int64_t value = node.as_integer()->get();
    if (value < target.range.lowest) return refuse(entry, node, "is too small");
    if (value > target.range.highest) return refuse(entry, node, "is too large");
    settings_.push_back({&entry, static_cast<int>(value)});
  }
  void take(const ParameterTable::Entry& entry, const ParameterTable::Boolean& /*target*/,
            const toml::node& node) {
    if (!node.is_boolean()) return refuse(entry, node, "is neither true nor false");
    settings_.push_back({&entry, node.as_boolean()->get()});
  }
  void take(const ParameterTable::Entry& entry, const ParameterTable::Text& target,
            const toml::node& node) {
    if (!node.is_string()) return refuse(entry, node, "is not text");
    const std::string& value = node.as_string()->get();
    const auto& choices = target.choices;
    if (!choices.empty() && std::find(choices.begin(), choices.end(), value) == choices.end())
      return refuse(entry, node, "is not known");
    settings_.push_back({&entry, value});
  }

  static void set(const Setting& setting) {
    std::visit(
        [&](const auto& target) {
          using Value = std::remove_pointer_t<decltype(target.value)>;
          *target.value = std::get<Value>(setting.value);
        },
        setting.entry->target);
  }

  const std::vector<ParameterTable::Entry>& entries_;
  const std::vector<ParameterTable::OldKey>& old_keys_;
  std::string name_;
  std::vector<std::string> problems_;
  std::vector<Setting> settings_;
};

}  // namespace

void ParameterTable::load(const std::filesystem::path& file) {
  load_text(read_config_file(file), file.string());
}

void ParameterTable::load_text(std::string_view toml, const std::string& name) {
  Loader loader(entries_, old_keys_);
  for (const ConfigLayer& layer : config_layers(toml, name)) loader.take(layer);
  loader.finish();
}

}  // namespace understory::bus
