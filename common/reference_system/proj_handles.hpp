// Handles of PROJ that release themselves. For this folder's sources alone.
#pragma once

#include <proj.h>

#include <Eigen/Core>
#include <memory>
#include <string>

namespace understory::reference_system {

/// Releases what PROJ gave.
struct ProjRelease {
  /// Ends a thread's context.
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
  /// Ends a system or an operation.
  void operator()(PJ* object) const { proj_destroy(object); }
};
/// A thread's context of PROJ.
using ContextHandle = std::unique_ptr<PJ_CONTEXT, ProjRelease>;
/// A system or an operation.
using ProjHandle = std::unique_ptr<PJ, ProjRelease>;

/// A context that prints nothing and asks no network.
ContextHandle new_context();
/// A horizontal system as summary_of() takes it. Throws ReferenceError.
ProjHandle horizontal_system(PJ_CONTEXT* context, const std::string& text);
/// The registry's code of a system, else its name.
std::string code_of(PJ* system);
/// The operation between two systems, first coordinate east. Throws ReferenceError.
ProjHandle operation_between(PJ_CONTEXT* context, PJ* from, PJ* to, PJ_AREA* area);
/// Coordinates through an operation. Throws ReferenceError.
Eigen::Vector2d passed(PJ* operation, PJ_DIRECTION direction, const Eigen::Vector2d& at);

}  // namespace understory::reference_system
