#pragma once
// How far a small flaw of the measurement would move each result: the data are changed as the flaw would change them, and
// everything is identified again, so that whatever the fit does with the flaw is in the figure. Flaws: speed 0.1 % high,
// current 1 % high, voltage 1 % high, voltage 10 us late. Small flaws add and scale; a record that goes in or out with the
// flaw is in the figure too.

#include <map>
#include <string>
#include <vector>

#include "estimators/fit/identify.h"

namespace imrig::est {

enum class Flaw { kSpeedHigh, kCurrentHigh, kVoltageHigh, kVoltageLate };

struct FlawMoves {
  std::string flaw;                     // in words
  std::string failure;                  // why nothing could be identified; empty otherwise
  std::map<std::string, double> moved;  // base parameter -> relative change, of those that stay known
};

// times: of the flaw's size. Time series and tables of points; a late voltage turns the phase of a table's power.
DataSet flawed(const DataSet& data, Flaw flaw, double times = 1.0);

// Identifies the data once a flaw and compares with what was found.
std::vector<FlawMoves> flaw_moves(const DataSet& data, const IdentifyOptions& options, const Model& found);

// What `imrig identify --sensitivity --json` adds: key "moves".
std::string add_moves(const std::string& json, const std::vector<FlawMoves>& moves);

}  // namespace imrig::est
