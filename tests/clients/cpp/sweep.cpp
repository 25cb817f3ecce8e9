// A sweep of case 5.1 by the generated client: sweep HOST PORT

#include <boost/json/src.hpp>
#include <cstdlib>
#include <iomanip>
#include <iostream>

#include "DriveApi.h"
#include "HttpClientImpl.h"
#include "StudySearch.h"

using namespace org::openapitools::client::api;
using namespace org::openapitools::client::model;

static void require(bool holds, const char* what) {
  if (holds) return;
  std::cerr << what << '\n';
  std::exit(1);
}

static std::shared_ptr<Design> design(double tooth_radius_mm) {
  WaveGeneratorEllipse ellipse;
  ellipse.setSemiMajorMm(58.0);
  ellipse.setSemiMinorMm(56.0);
  TeethCylinder cylinders;
  cylinders.setCount(28);
  cylinders.setRadiusMm(tooth_radius_mm);
  cylinders.setWidthMm(15.0);
  RingDocument ring;
  ring.setTeeth(26);
  DriveDocument drive;
  drive.setWaveGenerator(ellipse);
  drive.setTeeth(cylinders);
  drive.setRing(ring);
  LoadDocument load;
  load.setInputTorqueNm(20.0);
  ModelDocument model;
  model.setCompatibility("projection");
  model.setStiffness(StiffnessLinear());
  auto document = std::make_shared<Design>();
  document->setDrive(drive);
  document->setLoad(load);
  document->setModel(model);
  return document;
}

int main(int, char** arguments) {
  auto connection = std::make_shared<HttpClientImpl>(arguments[1], arguments[2]);
  DriveApi api(connection);
  auto answer = api.sweep(design(5.0), boost::none, "");
  std::cout << std::setprecision(12) << answer->getPeaks().getWaveGenerator().getForceN().getValue() << '\n';

  auto tooth = api.drawing(std::make_shared<DrawnPart>("tooth"), design(5.0), boost::none, "");
  require(std::holds_alternative<OutlineAnswerCircle>(tooth->getBodies().at(0).getOuter()), "a cylinder's outline is a circle");

  try {
    api.sweep(design(-1.0), boost::none, "");
    require(false, "a negative radius is refused");
  } catch (const DriveApiException& refusal) {
    Problem problem;
    problem.fromJsonString(refusal.getResponseBody());
    require(problem.getErrors().at(0).getPointer() == "/drive/teeth/radius_mm", "the field at fault is named");
  }

  // A choice that no field of its own tells apart: a limit is a flag or a range, a value a word, a number or a flag.
  RangeDocument range;
  range.setMax(120.0);
  require(std::holds_alternative<RangeDocument>(Require(range)), "a range is a limit");
  require(std::holds_alternative<bool>(Require(false)), "a flag is a limit");
  require(std::holds_alternative<std::string>(ChoiceValue(std::string("ball"))), "a word is a value");
}
