/PROG  WELD
/MN
   1:L P[1] 100mm/sec CNT100    ;
   2:L P[2] 100mm/sec CNT100    ;
   3:L P[3] 100mm/sec CNT100    ;
   4:L P[4] 100mm/sec CNT100    ;
   5:L P[5] 100mm/sec CNT100    ;
/POS
P[1]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = 700.000  mm,	Y = 300.000  mm,	Z = 120.000  mm,
	W = 180.000 deg,	P = -20.000 deg,	R = 43.303 deg
};
P[2]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = 800.000  mm,	Y = 384.852  mm,	Z = 120.000  mm,
	W = 180.000 deg,	P = -20.000 deg,	R = 33.680 deg
};
P[3]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = 900.000  mm,	Y = 420.000  mm,	Z = 120.000  mm,
	W = 180.000 deg,	P = -20.000 deg,	R = 0.000 deg
};
P[4]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = 1000.000  mm,	Y = 384.852  mm,	Z = 120.000  mm,
	W = 180.000 deg,	P = -20.000 deg,	R = -33.680 deg
};
P[5]{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = 1100.000  mm,	Y = 300.000  mm,	Z = 120.000  mm,
	W = 180.000 deg,	P = -20.000 deg,	R = -43.303 deg
};
/END
