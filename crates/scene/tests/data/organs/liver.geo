// A liver: an ellipsoid with a lobe and a groove, held below; lengths in m. `gmsh -3 liver.geo` writes liver.msh (Gmsh 4.8.4).
SetFactory("OpenCASCADE");
Mesh.MeshSizeMax = 0.04;
Mesh.MeshSizeMin = 0.015;
Mesh.MeshSizeFromCurvature = 5;
Mesh.ElementOrder = 1;
Sphere(1) = {0, 0, 0, 1};
Dilate{{0, 0, 0}, {0.1, 0.06, 0.05}}{ Volume{1}; }
Sphere(2) = {0.07, 0.02, 0.01, 0.045};
BooleanUnion(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Cylinder(4) = {-0.2, -0.075, 0, 0.4, 0, 0, 0.03};
BooleanDifference(5) = { Volume{3}; Delete; }{ Volume{4}; Delete; };
Box(6) = {-0.2, -0.2, -0.2, 0.4, 0.4, 0.17};
BooleanDifference(7) = { Volume{5}; Delete; }{ Volume{6}; Delete; };
held() = Surface In BoundingBox{-0.2, -0.2, -0.0301, 0.2, 0.2, -0.0299};
Physical Volume("tissue") = {7};
Physical Surface("held") = {held()};
free() = CombinedBoundary{ Volume{7}; };
free() -= held();
Physical Surface("free") = {free()};
