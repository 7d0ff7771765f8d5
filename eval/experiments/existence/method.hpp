// A way to tell which points still exist, fed with the looks of one drive after another.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "eval/experiments/existence/looks.hpp"

namespace understory::eval::experiments::existence {

/// Of one map. Called in the order of time.
class Method {
 public:
  Method() = default;
  Method(const Method&) = delete;
  Method& operator=(const Method&) = delete;
  virtual ~Method() = default;

  /// Before the looks of a drive; time since the first drive [s].
  virtual void begin_drive(double time_s) = 0;
  virtual void look(const LookEvent& event) = 0;
  virtual void end_drive() {}
  /// P of a point now.
  virtual double probability(std::size_t point) const = 0;
};

/// Makes a method for a map. What it must not know (changes, truth) it does not read.
using MakeMethod = std::unique_ptr<Method> (*)(const History&, const std::vector<double>&);

/// A method that has parameters to be tuned: a grid of values for each.
struct MethodKind {
  std::string name;
  MakeMethod make = nullptr;
  std::vector<std::vector<double>> grid;  ///< Values to try; empty: nothing to tune.
};

/// All drives up to one, `last` included, fed to a method.
void feed(Method& method, const History& history, std::size_t first, std::size_t last);

}  // namespace understory::eval::experiments::existence
