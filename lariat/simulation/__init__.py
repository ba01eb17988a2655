"""lariat/simulation"""
