// A left ventricle: half of a thick ellipsoid, held at its base; lengths in m. `gmsh -3 ventricle.geo` writes ventricle.msh (Gmsh 4.8.4).
SetFactory("OpenCASCADE");
Mesh.MeshSizeMax = 0.016;
Mesh.MeshSizeMin = 0.008;
Mesh.MeshSizeFromCurvature = 6;
Mesh.ElementOrder = 2;
Mesh.HighOrderOptimize = 2;
Sphere(1) = {0, 0, 0, 1};
Dilate{{0, 0, 0}, {0.03, 0.03, 0.06}}{ Volume{1}; }
Sphere(2) = {0, 0, 0, 1};
Dilate{{0, 0, 0}, {0.018, 0.018, 0.048}}{ Volume{2}; }
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Box(4) = {-0.1, -0.1, 0.02, 0.2, 0.2, 0.2};
BooleanDifference(5) = { Volume{3}; Delete; }{ Volume{4}; Delete; };
held() = Surface In BoundingBox{-0.1, -0.1, 0.0199, 0.1, 0.1, 0.0201};
Physical Volume("tissue") = {5};
Physical Surface("held") = {held()};
free() = CombinedBoundary{ Volume{5}; };
free() -= held();
Physical Surface("free") = {free()};
