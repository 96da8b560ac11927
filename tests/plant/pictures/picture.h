#pragma once
// A picture of docs/plant: a few curves over one axis, from the plant's own output. scripts/plant-pictures
// writes them to docs/plant/img; pictures_test.cc holds the files against what the plant says today.

#include <string>
#include <vector>

namespace imrig::plant::pictures {

struct Series {
  std::string label;
  std::vector<double> x, y;
  bool dashed = false;
  void add(double at, double value) { x.push_back(at), y.push_back(value); }
};

struct Picture {
  std::string name;  // of the file, without .svg; an effect's name shows that effect
  std::string title, x_label, y_label;
  std::vector<Series> series;
  bool square = false;  // one scale for both axes, as for a vector's locus
};

std::vector<Picture> magnetic_pictures();    // saturation, rotor bar, iron, generator
std::vector<Picture> mechanical_pictures();  // friction, windage, stray loss, sticking, torsion, heat
std::vector<Picture> fault_pictures();       // lines and loci of unequal motors and supplies
std::vector<Picture> inverter_pictures();
std::vector<Picture> sensor_pictures();
std::vector<Picture> all_pictures();

// A whole SVG file: text, one line an element, coordinates to a tenth of a point.
std::string svg(const Picture& picture);

}  // namespace imrig::plant::pictures
