// One list of parameters for loading, checking, --help and the printed configuration file.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace understory::bus {

/// The faults of a configuration, one per line: file:line: key: fault, and the allowed values.
class ConfigurationError : public std::runtime_error {
 public:
  /// what() is all problems, one per line.
  explicit ConfigurationError(std::vector<std::string> problems);
  /// One line each.
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  std::vector<std::string> problems_;
};

/// Lowest and highest value allowed, both included.
template <class T>
struct Range {
  T lowest;
  T highest;
};

/// A list of parameters, each bound to a variable that has the default value when added. Keys are
/// dotted paths of TOML tables, e.g. joint.gate_sigmas.
class ParameterTable {
 public:
  /// A real parameter with its default and range.
  struct Number {
    double* value;
    double fallback;
    Range<double> range;
  };
  /// A whole-number parameter with its default and range.
  struct Integer {
    int* value;
    int fallback;
    Range<int> range;
  };
  /// A Boolean parameter with its default.
  struct Boolean {
    bool* value;
    bool fallback;
  };
  /// A text parameter with its default.
  struct Text {
    std::string* value;
    std::string fallback;
    std::vector<std::string> choices;  ///< Empty = anything.
  };
  /// One parameter: its key, its unit ("" = none), one sentence of description, and its variable.
  struct Entry {
    std::string key;
    std::string unit;
    std::string doc;
    std::variant<Number, Integer, Boolean, Text> target;
  };

  /// A key of an older version: its new name, or the reason of its removal.
  struct OldKey {
    std::string name;      ///< Ends in "." where it is all keys of a TOML table.
    std::string new_name;  ///< Empty where the key was removed.
    std::string why_removed;
  };

  /// Adds a real parameter; `value` has the default and must outlive the table. Throws
  /// std::logic_error for a repeated key.
  void add(std::string key, double& value, Range<double> range, std::string unit, std::string doc);
  /// Adds a whole-number parameter.
  void add(std::string key, int& value, Range<int> range, std::string unit, std::string doc);
  /// Adds a Boolean parameter.
  void add(std::string key, bool& value, std::string doc);
  /// Adds a text parameter; `choices` empty = any text.
  void add(std::string key, std::string& value, std::vector<std::string> choices, std::string doc);

  /// A renamed key: it is refused with the new key in the message. Both may end in "." and then
  /// mean all keys of a TOML table.
  void renamed(std::string old_key, std::string new_key);
  /// A removed key (or all keys of a TOML table if it ends in "."): it is refused with this reason,
  /// which names the replacement.
  void removed(std::string old_key, std::string why);

  /// All parameters in the order of adding.
  const std::vector<Entry>& entries() const { return entries_; }
  /// All rules added by renamed() and removed().
  const std::vector<OldKey>& old_keys() const { return old_keys_; }

  /// Sets the values of the file, over those of its base file (key `base`); other parameters keep
  /// their defaults. Throws ConfigurationError with all faults; then no value has been set.
  void load(const std::filesystem::path& file);
  /// The same from text; `name` is the file's name in messages; a `base` is relative to it.
  void load_text(std::string_view toml, const std::string& name);

  /// A configuration file with the values in force, each with its unit, range and meaning.
  std::string to_toml() const;
  /// The same for a terminal, one line per parameter, with defaults.
  std::string help() const;

 private:
  void check_is_new(const std::string& key) const;

  std::vector<Entry> entries_;
  std::vector<OldKey> old_keys_;
};

/// "0.5", "true", "\"joint\"": the value as TOML, shortest form that reads back the same.
std::string value_as_toml(const ParameterTable::Entry& entry);
/// "0 .. 10 m", "one of \"a\", \"b\"", "true or false".
std::string allowed(const ParameterTable::Entry& entry);

}  // namespace understory::bus
